"""Does the latent carry the body, besides the task? Probes of `position` on three bodies that solve the same goals.

    .venv/bin/python benchmarks/shortcuts.py

Target: a linear probe fitted on the toy's latents, read on each body's. Body: a classifier of it (quadratic in the
latent, and told the goal), fitted on half of the goals and tried on the others; with nothing of the body in the latent
it is right as often as chance. Velocity: what share of the variance of vx a linear probe finds in latent and goal.
Beliefs after decisions 20 to 200.
"""

from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import load_robot
from rebody.evaluation.evaluate import run_trial, start_seeds, trial_agent
from rebody.evaluation.trial import Trial
from rebody.inference.probe import fit_probe
from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.line import GOAL
from rebody.tasks.task_file import active_tasks, read_tasks
from rebody.types import DECISION_DT, Belief

TASKS = Path(__file__).parent / "tasks" / "position-cheetah.json"
FROM = 20


def main() -> None:
    specs = read_tasks(TASKS, SHIPPED)
    target = np.array([spec.target[0] for spec in specs])
    latents, speeds = {}, {}
    for name, trial in trials().items():
        tasks = active_tasks(specs, trial.in_play, trial.decisions, DECISION_DT)
        episodes = run_trial(trial, trial_agent(trial, tasks), tasks, start_seeds(specs, np.zeros(len(specs), int)))
        latents[name] = np.asarray(episodes.belief.mean, float)[FROM:]
        speeds[name] = np.asarray(episodes.state.vx, float)[FROM:]
    print_targets(latents, target)
    print_bodies(latents, target)
    print_speeds(latents, speeds, target)


def trials() -> dict[str, Trial]:
    """The toy, a toy of twice the mass, the cheetah."""
    module = load_inference("position")
    toy = Trial("reuse", module, SHIPPED, None, None)
    heavier = eqx.tree_at(lambda t: t.mass, module.toy, 2.0 * module.toy.mass)
    robot = Trial("reuse", module, SHIPPED, load_robot("cheetah"), load_tracker("tracker-cheetah"))
    return {"toy": toy, "heavier toy": replace(toy, toy=heavier), "cheetah": robot}


def print_targets(latents: dict[str, np.ndarray], target: np.ndarray) -> None:
    shape = latents["toy"].shape[:2]
    wanted = np.broadcast_to(target, shape)
    known = latents["toy"].reshape(-1, latents["toy"].shape[-1])
    probe = fit_probe(FamilySet((GOAL,)), known, np.zeros(wanted.size, int), wanted.reshape(-1, 1))
    print("| body | target read by the toy's probe: R2 | median error [m] |\n|---|---|---|")
    for name, latent in latents.items():
        _, read = probe(Belief(jnp.asarray(latent, jnp.float32), jnp.zeros(latent.shape)))
        error = np.asarray(read)[..., 0] - wanted
        print(f"| {name} | {1 - np.var(error) / np.var(wanted):.6f} | {np.median(np.abs(error)):.4f} |")


def print_bodies(latents: dict[str, np.ndarray], target: np.ndarray) -> None:
    print("\n| told apart | right on other goals | chance |\n|---|---|---|")
    for names in (("toy", "heavier toy"), ("toy", "cheetah"), tuple(latents)):
        features = np.stack([features_of(latents[name], target) for name in names])  # [body, time, goal, feature]
        features /= features.std(axis=(0, 1, 2))
        body = np.broadcast_to(np.arange(len(names))[:, None, None], features.shape[:3])
        fitted, tried = features[:, :, ::2], features[:, :, 1::2]
        size = features.shape[-1]
        kinds = FamilySet(tuple(replace(GOAL, name=name.replace(" ", "_")) for name in names))
        probe = fit_probe(kinds, fitted.reshape(-1, size), body[:, :, ::2].ravel(), np.zeros((body[:, :, ::2].size, 1)))
        said, _ = probe(Belief(jnp.asarray(tried, jnp.float32), jnp.zeros(tried.shape)))
        right = np.mean(np.asarray(said) == body[:, :, 1::2])
        print(f"| {', '.join(names)} | {100 * right:.1f} % | {100 / len(names):.1f} % |")


def features_of(latent: np.ndarray, target: np.ndarray) -> np.ndarray:
    """What is left of the latent when the goal's share is taken out, its squares, and the goal."""
    goal = np.broadcast_to(target[:, None], (*latent.shape[:2], 1))
    known = np.concatenate([goal, np.ones_like(goal)], -1)
    flat, of_goal = latent.reshape(-1, latent.shape[-1]), known.reshape(-1, 2)
    rest = (flat - of_goal @ np.linalg.lstsq(of_goal, flat, rcond=None)[0]).reshape(latent.shape)
    return np.concatenate([rest, rest**2, rest * goal, goal], axis=-1)


def print_speeds(latents: dict[str, np.ndarray], speeds: dict[str, np.ndarray], target: np.ndarray) -> None:
    print("\n| body | share of the variance of vx in goal alone | in goal and latent |\n|---|---|---|")
    for name, latent in latents.items():
        goal = np.broadcast_to(target[:, None], (*latent.shape[:2], 1))
        shares = [explained(x, speeds[name]) for x in (goal, np.concatenate([goal, latent], -1))]
        print(f"| {name} | {shares[0]:.3f} | {shares[1]:.3f} |")


def explained(x: np.ndarray, y: np.ndarray) -> float:
    x = np.concatenate([x, np.ones((*x.shape[:2], 1))], -1).reshape(y.size, -1)
    return float(1 - np.var(y.ravel() - x @ np.linalg.lstsq(x, y.ravel(), rcond=None)[0]) / np.var(y))


if __name__ == "__main__":
    main()
