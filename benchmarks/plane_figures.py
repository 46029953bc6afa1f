"""The figures of `plane.py`: paths and ellipses, believed beside true places and headings, one belief sharpened."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rebody.agents.parts import Inference
from rebody.errors import RebodyError
from rebody.evaluation import evaluate
from rebody.evaluation.listening import listen
from rebody.evaluation.trial import Trial
from rebody.inference.decoder import Expert
from rebody.inference.hypotheses import GUESS_DEVIATIONS, Hypotheses
from rebody.inference.reader import PlaceReader
from rebody.inference.refine import STEPS, Heard, Known, refine, surprise
from rebody.inference.sharpened import Sharpened
from rebody.report.plane import path_of
from rebody.report.plane_beliefs import EDGE_M, FAINTEST, draw_against, draw_headings, draw_path, draw_sharpening
from rebody.report.style import figure
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec
from rebody.training.inference.measure import Outcome, read
from rebody.types import Belief, GlobalState, Transition, global_state

PLACE, HEADING = "place", "heading"
PATHS, SECONDS = 6, 10.0
AFTER, HEADINGS_AFTER = (5, 10, 20), (3, 5, 10)
EARLY = range(5, 16)
"""Decisions after one of which a belief is shown being sharpened."""
NEAR_M, FAR_M, APART_M = 1.0, 3.0, 5.0
"""Of that belief: how near its likeliest place is to the true one at most, and how far the guess is from that, and the
other place, at least."""
POINTS, ALONG, FINER = 161, np.linspace(-1.0, 1.0, 41), (4.0, 0.2, 0.01)
"""Of a map along each axis; of what no place depends on, and within how much of the best so far, ever finer."""


def draw_all(module: Inference, outcome: Outcome, folder: Path) -> None:
    """All of them, as PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    draw_places(module, outcome, folder / "places.png")
    draw_circles(module, outcome, folder / "headings.png")
    draw_paths(module, outcome, folder / "paths.png")
    draw_one_sharpened(module, outcome, folder / "sharpening.png")


def draw_paths(module: Inference, outcome: Outcome, path: Path) -> None:
    """The first held-out places."""
    targets = np.asarray(outcome.tasks.target)[0, of_family(outcome, PLACE)[:PATHS]]
    trial = Trial("reuse", module, SHIPPED, None, None, sharpen=True, seconds=SECONDS)
    results = evaluate(trial, [TaskSpec(PLACE, tuple(map(float, target))) for target in targets], 1)
    with figure(path, 2, PATHS // 2, size=(10, 7.2)) as (drawing, panels):
        for panel, episode, target in zip(panels, results.episodes, targets, strict=True):
            readings, moved = listen(module, episode, sharpen=True), path_of(episode)
            assert readings is not None
            assert moved is not None
            draw_path(panel, moved, readings, target, PLACE)
        share_legend(drawing, panels[0])


def draw_places(module: Inference, outcome: Outcome, path: Path) -> None:
    """Coordinates of believed places beside the true ones."""
    true, believed, right = beside(module, outcome, PLACE)
    with figure(path, 2, len(AFTER), size=(8.6, 6.0)) as (drawing, panels):
        for i, after in enumerate(AFTER):
            for axis, panel in enumerate((panels[i], panels[i + len(AFTER)])):
                draw_against(panel, true[:, axis], believed[after - 1, :, axis], right[after - 1])
                panel.set(xlabel=f"true {'xy'[axis]} [m]", ylabel=f"believed {'xy'[axis]} [m]")
            panels[i].set_title(f"after {after} decisions ({after / 10:g} s)")
        share_legend(drawing, panels[0])


def draw_circles(module: Inference, outcome: Outcome, path: Path) -> None:
    """Believed headings beside the true ones."""
    true, believed, right = beside(module, outcome, HEADING)
    with figure(path, 1, len(HEADINGS_AFTER), size=(9.6, 4.1)) as (drawing, panels):
        for after, panel in zip(HEADINGS_AFTER, panels, strict=True):
            draw_headings(panel, true[:, 0], believed[after - 1, :, 0], right[after - 1])
            panel.set(title=f"after {after} decisions ({after / 10:g} s)", xlabel="heading [rad]")
        share_legend(drawing, panels[0])


def share_legend(drawing, panel) -> None:
    """One legend for all panels, below them."""
    handles, labels = panel.get_legend_handles_labels()
    drawing.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    for each in drawing.axes:
        for line in each.lines:
            line.set_label("_")  # or each would get its own


def of_family(outcome: Outcome, name: str) -> np.ndarray:
    """Indices of its episodes."""
    return np.flatnonzero(outcome.tasks.family[0] == outcome.families.index(name))


def beside(module: Inference, outcome: Outcome, name: str):
    """Of the episodes of a family: true targets [episode, size], those believed if it is that family [time, episode,
    size], and whether that family is the likeliest [time, episode]."""
    own, which = of_family(outcome, name), outcome.families.index(name)
    reader = PlaceReader(module.parts.module.decoder, outcome.families)
    mean, _ = reader.spreads(outcome.episodes.belief)[which]
    said, _ = read(reader, outcome)
    true = np.asarray(outcome.tasks.target)[0, own, : outcome.families[which].size]
    return true, np.asarray(mean)[:, own], said[:, own] == which


def draw_one_sharpened(module: Inference, outcome: Outcome, path: Path) -> None:
    """One early belief in a place, of those that steps from the guess bring to the true place, and that know another
    place: that which is most in doubt between them."""
    own, which = of_family(outcome, PLACE), outcome.families.index(PLACE)
    target, early = np.asarray(outcome.tasks.target)[0, own, :2], EARLY.stop - 1
    sharp = Sharpened(module.parts.module.encoder, module.parts.module.decoder, tells_evidence=True)
    expert = sharp.decoder.experts[which]
    states = jax.tree.map(lambda leaf: jnp.asarray(leaf[:early, own]), outcome.episodes.state)
    heard, guess, hypotheses = retold(sharp, which, states, jnp.asarray(outcome.episodes.reward[:early, own]))
    steps = metres(expert, steps_from(heard, guess))
    known = metres(expert, hypotheses.amounts)
    moved = np.stack([np.asarray(states.x), np.asarray(states.y)], axis=-1)
    time, one = most_in_doubt(np.asarray(hypotheses.cost), known, steps, moved, target)
    shown = steps[:, time, one], known[time, one, 1], target[one]
    places, nats = likelihood(taken(heard, time, one), np.concatenate([np.zeros((1, 2)), *map(np.atleast_2d, shown)]))
    walked = np.concatenate([np.zeros((1, 2)), moved[: time + 1, one]])
    with figure(path, 1, 1, size=(7.2, 5.6)) as (drawing, (panel,)):
        image = draw_sharpening(panel, places, nats, walked, *shown)
        panel.set_title(f"after {time + 1} decisions ({(time + 1) / 10:g} s)")
        bar = drawing.colorbar(image, ax=panel, extend="max", label="rewards off by [standard deviations]")
        bar.ax.set_ylim(0, FAINTEST)
        share_legend(drawing, panel)


@eqx.filter_jit
def retold(sharp: Sharpened, which: int, states: GlobalState, rewards: jax.Array) -> tuple[Heard, Belief, Hypotheses]:
    """After each decision, [time, episode]: what the expert `which` is to explain, what the encoder alone says of its
    amounts, and what is believed."""
    decoder, expert = sharp.decoder, sharp.decoder.experts[which]

    def hear(walk, now):
        memory, previous = walk
        state, reward = now
        transition = Transition(previous, reward, state)
        _, guess = sharp.encoder.step(memory.carry, transition)
        memory, _ = sharp.step(memory, transition)
        window = memory.rewards.shape[-1]
        is_heard = jnp.arange(window) >= window - memory.heard[:, None]
        heard = decoder.read(expert, memory.states), memory.rewards, is_heard
        amounts = Belief(*(decoder.amounts(each[..., decoder.kinds :])[which] for each in (guess.mean, guess.variance)))
        return (memory, state), (heard, amounts, memory.experts[which])

    begun = sharp.initial(rewards.shape[1:]), global_state(x=jnp.zeros_like(rewards[0]))
    _, (heard, guess, hypotheses) = jax.lax.scan(hear, begun, (states, rewards))
    return Heard(expert, *heard), guess, hypotheses


def most_in_doubt(
    cost: np.ndarray, known: np.ndarray, steps: np.ndarray, moved: np.ndarray, target: np.ndarray
) -> tuple[int, int]:
    """Decision and episode: by costs [time, episode, 2] and places [time, episode, 2, 2] of hypotheses, steps
    [step, time, episode, 2], where bodies are [time, episode, 2], and true places [episode, 2]."""
    suits = np.isfinite(cost).all(axis=-1) & (np.abs(known) < EDGE_M).all(axis=(-1, -2))
    for each in (steps[-1], known[..., 0, :]):
        suits &= np.linalg.norm(each - target, axis=-1) < NEAR_M
    suits &= np.linalg.norm(steps[0] - target, axis=-1) > FAR_M
    suits &= np.linalg.norm(known[..., 0, :] - known[..., 1, :], axis=-1) > APART_M
    # the body has gone by between the two: they are mirror images about its way, or nearly
    across = moved[..., None, 0] * known[..., 1] - moved[..., None, 1] * known[..., 0]
    suits &= across[..., 0] * across[..., 1] < 0
    suits[: EARLY.start - 1] = False
    if not suits.any():
        raise RebodyError("no early belief is in doubt between two places: give more --tasks.")
    time, one = np.unravel_index(np.argmin(np.where(suits, cost[..., 1] - cost[..., 0], np.inf)), suits.shape)
    return int(time), int(one)


def taken(heard: Heard, time: int, one: int) -> Heard:
    """That after one decision of one episode."""
    return Heard(heard.expert, heard.states[time, one], heard.rewards[time, one], heard.is_heard[time, one])


def metres(expert: Expert, amounts) -> np.ndarray:
    """Places that an expert means by amounts [..., amount]."""
    return np.asarray(expert.place(amounts)) * np.array(expert.scales)


@eqx.filter_jit
def steps_from(heard: Heard, guess: Belief) -> jax.Array:
    """Amounts at the guesses [*batch], and after each step from there, [step, *batch, amount]."""

    def one(states, rewards, is_heard, mean, variance):
        size = len(mean)
        nothing = Known(jnp.zeros((size, size)), jnp.zeros(size), mean, 1 / (GUESS_DEVIATIONS * variance**0.5))
        own = Heard(heard.expert, states, rewards, is_heard)
        return jnp.stack([jnp.asarray(refine(own, mean, nothing, steps).amount) for steps in range(STEPS + 1)])

    for _ in heard.rewards.shape[:-1]:
        one = jax.vmap(one, out_axes=1)
    return one(heard.states, heard.rewards, heard.is_heard, guess.mean, guess.variance)


def likelihood(heard: Heard, around: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places [row, column, 2] in m around those given [point, 2], and what each leaves unexplained of the rewards
    [nats]: the least over the weights of a distance that the expert may mean there."""
    low, high = around.min(axis=0), around.max(axis=0)
    line = 0.7 * (high - low).max() * np.linspace(-1.0, 1.0, POINTS)
    places = (low + high) / 2 + np.stack(np.meshgrid(line, line), axis=-1)
    expert = heard.expert
    weights, bias = np.asarray(expert.reference.weights[0]), np.asarray(expert.reference.biases[0])
    amounts = (places / np.array(expert.scales) - bias) @ np.linalg.pinv(weights)
    free = np.linalg.svd(weights)[0][:, -1]  # no place depends on this

    @jax.jit
    def left(amount):
        off = surprise(expert, heard.states, heard.rewards, amount[..., None, :])
        return 0.5 * jnp.sum(jnp.where(heard.is_heard, off, 0.0) ** 2, axis=-1)

    best = np.zeros(places.shape[:-1])
    for width in FINER:
        tried = [best + width * step for step in ALONG]
        nats = [np.asarray(left(jnp.asarray(amounts + each[..., None] * free, jnp.float32))) for each in tried]
        best = np.take_along_axis(np.array(tried), np.argmin(nats, axis=0)[None], axis=0)[0]
    return places, np.min(nats, axis=0)
