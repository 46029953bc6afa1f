"""Rewards that no known task pays, on a real gait: are they told from known ones, and are the proposals right?

    .venv/bin/python benchmarks/unknown.py [--episodes 20] [--json FILE]

The shipped quadruped walks under random joystick commands, each episode under commands of its own; rewards are computed
on the states of that gait and told to the frozen module `plane-any`. Known rewards are of its own families, under laws
as training draws them, costs of joint actions, noise and delays included. AUROC says how well `explained` (the share of
the rewards' variance that the likeliest known task explains) tells each kind of alien rewards from them; intervals
resample episodes.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from sklearn.metrics import roc_auc_score

from rebody.agents.parts import Inference, load_inference
from rebody.agents.unknown import Explained
from rebody.bodies import load_robot, simulate
from rebody.inference.any_law import SharpenedByAnyLaw
from rebody.inference.proposal import LIBRARY, propose
from rebody.jax_settings import own_jax_settings
from rebody.tasks.family_set import sample
from rebody.tasks.quantities import Quantity
from rebody.training.inference.laws import LawDistribution, first_pay
from rebody.types import DECISION_DT, GlobalState, Task, Transition

AFTER = (20, 30, 50)
"""Decisions after which a module is asked whether it knows."""
PROPOSED_AFTER = (50, 100)
HELD_S = 2.0
"""Mean time for which a command is held."""
RESAMPLED = 500
NOISE = 0.01
"""Standard deviation of the noise on rewards that are to be proposed for, as a share of their own."""
Rewards = Float[np.ndarray, "time episode"]
LAWS = {
    "distance": lambda e: -e,
    "squared": lambda e: -(e**2),
    "gaussian": lambda e: np.exp(-((e / 0.5) ** 2)),
    "clipped": lambda e: -np.minimum(e, 0.7),
}
"""Of an error in half spans of the quantity on this gait."""


@own_jax_settings()
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=20, help="of each kind of rewards")
    parser.add_argument("--json", type=Path, help="file for all figures")
    options = parser.parse_args()
    states, actions = gait(options.episodes, max(PROPOSED_AFTER))
    told = told_apart(load_inference("plane-any"), states, actions)
    right = proposals(states)
    if options.json is not None:
        options.json.write_text(json.dumps({"told apart": told, "proposals": right}, indent=1))


def gait(episodes: int, decisions: int) -> tuple[GlobalState, Float[np.ndarray, "time episode joint"]]:
    """States [time, episode] of quadrupeds under random commands, and what moved their joints before each."""
    robot, rng = load_robot("quadruped"), np.random.default_rng(0)
    batch = simulate(robot, episodes)
    batch.reset(rng)
    states, actions = [batch.observe()], [np.zeros((episodes, 1))]
    command = rng.uniform(-1, 1, (episodes, batch.actions))
    for _ in range(decisions):
        is_new = rng.uniform(size=(episodes, 1)) < DECISION_DT / HELD_S
        command = np.where(is_new, rng.uniform(-1, 1, command.shape), command)
        for _ in range(batch.steps_per_decision):
            batch.step(command)
        states.append(batch.observe())
        actions.append(batch.joint_actions.copy())
    return jax.tree.map(lambda *each: np.stack(each), *states), np.stack(actions[1:])


def told_apart(inference: Inference, states: GlobalState, actions: Float[np.ndarray, "time episode joint"]) -> Any:
    """AUROC of each kind of alien rewards after so many decisions; prints the table."""
    kinds = {"known": known(inference, states, actions)} | aliens(states)
    share = dict(zip(kinds, explained(inference, states, list(kinds.values())), strict=True))
    figures: dict[str, Any] = {name: {} for name in kinds}
    print(f"| rewards | {' | '.join(f'AUROC after {after}' for after in AFTER)} | said to be unknown after 30 and 50 |")
    print("|---" * (len(AFTER) + 2) + "|")
    for name in kinds:
        if name != "known":
            figures[name] = {str(after): auroc(share["known"][after], share[name][after]) for after in AFTER}
        unknown = [
            float(np.mean([Explained(each, after).is_unknown for each in share[name][after]])) for after in AFTER[1:]
        ]
        figures[name]["said to be unknown"] = unknown
        cells = [
            "{:.3f} [{:.3f}, {:.3f}]".format(*figures[name][str(after)]) if name != "known" else "" for after in AFTER
        ]
        print(f"| {name} | {' | '.join(cells)} | {', '.join(f'{100 * each:.0f} %' for each in unknown)} |", flush=True)
    return figures


def known(inference: Inference, states: GlobalState, actions: Float[np.ndarray, "time episode joint"]) -> Rewards:
    """Rewards of the module's own families, under laws as training draws them."""
    episodes, families = states.x.shape[1], inference.contract.families
    task_key, law_key, noise_key = jax.random.split(jax.random.key(1), 3)
    task: Task = sample(families, task_key, (episodes,))
    pay, heard = first_pay(LawDistribution().draw(law_key, (episodes,)), (episodes,)), []
    for decision, action in enumerate(actions):
        now = jax.tree.map(lambda leaf, at=decision + 1: jnp.asarray(leaf[at]), states)
        key = jax.random.fold_in(noise_key, decision)
        pay, reward = pay.after(families, task, now, jnp.asarray(action), key)
        heard.append(np.asarray(reward))
    return np.stack(heard)


def aliens(states: GlobalState) -> dict[str, Rewards]:
    """Rewards that no place, velocity or heading explains, in any scale and with any bonus."""
    rng, shape = np.random.default_rng(2), (len(states.x) - 1, states.x.shape[1])
    after = jax.tree.map(lambda leaf: leaf[1:], states)
    turn, height = rng.uniform(-1, 1, shape[1]), np.quantile(after.z, 0.5, axis=0)
    phase, time = rng.uniform(0, 2 * np.pi, shape[1]), DECISION_DT * np.arange(shape[0])[:, None]
    around = 1.5 * time + phase
    kinds = {
        "white noise": rng.standard_normal(shape),
        "random walk": rng.standard_normal(shape).cumsum(axis=0),
        "turn rate": -abs(after.yaw_rate - turn),
        "circling target": -np.hypot(after.x - 3 * np.cos(around), after.y - 3 * np.sin(around)),
        "height": -abs(after.z - height),
    }
    scale, bonus = np.exp(rng.uniform(np.log(0.1), np.log(10), shape[1])), rng.uniform(0, 5, shape[1])
    return {name: np.asarray(scale * rewards + bonus, np.float32) for name, rewards in kinds.items()}


def explained(
    inference: Inference, states: GlobalState, kinds: list[Rewards]
) -> list[dict[int, Float[np.ndarray, " episode"]]]:
    """Of each kind of rewards, what the likeliest known task explains after so many decisions, episode by episode."""
    module, decisions = inference.parts.module, max(AFTER)
    inferrer = SharpenedByAnyLaw(module.encoder, module.decoder)
    many = jax.tree.map(lambda leaf: jnp.asarray(np.tile(leaf[: decisions + 1], (1, len(kinds)))), states)
    before, after = (jax.tree.map(lambda leaf, at=at: leaf[at : at + decisions], many) for at in (0, 1))
    rewards = jnp.asarray(np.concatenate([each[:decisions] for each in kinds], axis=1), jnp.float32)

    @eqx.filter_jit
    def listen(transitions):
        def step(memory, transition):
            memory, _ = inferrer.step(memory, transition)
            return memory, inferrer.explained(memory)

        return jax.lax.scan(step, inferrer.initial((rewards.shape[1],)), transitions)[1]

    shares = np.split(np.asarray(listen(Transition(before, rewards, after))), len(kinds), axis=1)
    return [{after: of_kind[after - 1] for after in AFTER} for of_kind in shares]


def auroc(known: Float[np.ndarray, " episode"], alien: Float[np.ndarray, " episode"]) -> tuple[float, float, float]:
    """That a known task is explained better than an alien one, with its 95 % interval over episodes."""
    rng, label = np.random.default_rng(0), np.repeat([1, 0], [len(known), len(alien)])

    def of(known, alien):
        return float(roc_auc_score(label, np.concatenate([known, alien])))

    drawn = [of(rng.choice(known, len(known)), rng.choice(alien, len(alien))) for _ in range(RESAMPLED)]
    low, high = np.quantile(drawn, [0.025, 0.975])
    return of(known, alien), float(low), float(high)


def proposals(states: GlobalState) -> Any:
    """How often the first proposal is right, of each quantity and of each law; prints the table."""
    quantities = [each for each in LIBRARY if each.frame == "world" and np.ptp(each.read(states), axis=0).min() > 1e-3]
    rng, figures = np.random.default_rng(3), {}
    for after in PROPOSED_AFTER:
        right = defaultdict(list)
        for i, quantity in enumerate(quantities):
            for j, law in enumerate(LAWS):
                episode = (i * len(LAWS) + j) % states.x.shape[1]
                own = jax.tree.map(lambda leaf, e=episode, n=after: leaf[1 : n + 1, e], states)
                first, *_ = propose(own, paid(quantity, law, own, rng))
                hit = first.quantity.components == quantity.components
                for row in (quantity.label, law, "all"):
                    right[row].append((hit, hit and first.kind == law))
        figures[after] = {row: np.mean(each, axis=0).tolist() for row, each in right.items()}
    heads = [f"after {after}: quantity, and law" for after in PROPOSED_AFTER]
    print(f"\n| first proposal right: rewards of | {' | '.join(heads)} |\n{'|---' * (1 + len(heads))}|")
    for row in (*(each.label for each in quantities), *LAWS, "all"):
        cells = ["{:.0f} %, {:.0f} %".format(*(100 * np.array(figures[after][row]))) for after in PROPOSED_AFTER]
        print(f"| {row} | {' | '.join(cells)} |")
    return figures


def paid(quantity: Quantity, law: str, states: GlobalState, rng: np.random.Generator) -> Float[np.ndarray, " time"]:
    """Rewards for a target that the gait has passed, in any scale, with any bonus and a little noise."""
    values = np.asarray(quantity.read(states))
    half = max(float(np.ptp(values, axis=0).max()) / 2, 1e-9)
    target = values[rng.integers(len(values))]
    rewards = LAWS[law](np.asarray(quantity.distance(values, target)) / half)
    rewards = rewards + NOISE * rewards.std() * rng.standard_normal(len(rewards))
    return np.asarray(np.exp(rng.uniform(-2, 2)) * rewards + rng.uniform(0, 5), np.float32)


if __name__ == "__main__":
    main()
