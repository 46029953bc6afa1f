"""Ours, stable-baselines3's SAC and sbx's SAC on one environment, `rebody/HalfCheetahTracker-v0`: error over time.

    .venv/bin/pip install stable-baselines3 sbx-rl
    .venv/bin/python benchmarks/tracker.py [--minutes 10] [--learners ours sb3 sbx] [--out runs/tracker-benchmark]

Each learns alone for the same wall time, evaluation not counted, compilation counted. The others with their default
settings, one environment and one update per step. Errors are those of 100 held-out goals (m) and speeds (m/s), 10 s
each.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np

import rebody  # noqa: F401 (registers the environment)
from rebody.bodies import RobotBatch, load_robot
from rebody.control.command import relative
from rebody.control.tracker import tracker_observation
from rebody.report.style import figure
from rebody.tasks.figures import final_error
from rebody.training import off_policy
from rebody.training.tracker import tracker_preset
from rebody.training.tracker.report import run_robots, speeds_within
from rebody.training.tracker.train import TrackerLearner
from rebody.types import Subgoal, Task

ENVIRONMENT = "rebody/HalfCheetahTracker-v0"
SPEC = load_robot("cheetah")
CONFIG = tracker_preset(SPEC)
COMMANDS = CONFIG.held_out
FAMILIES = CONFIG.families.only(("goal", "velocity"))
Predict = Callable[[np.ndarray], np.ndarray]


class Clock:
    """Measures errors every minute of learning; its own time does not count."""

    def __init__(self, minutes: float):
        self.minutes, self.rows, self._begun, self._paused = minutes, [], time.monotonic(), 0.0

    @property
    def elapsed(self) -> float:
        """Minutes of learning."""
        return (time.monotonic() - self._begun - self._paused) / 60

    def tick(self, predict: Predict) -> bool:
        """Measure where a minute has passed; False once time is up."""
        if self.elapsed >= min(len(self.rows) + 1, self.minutes):
            paused, minutes = time.monotonic(), self.elapsed
            self.rows.append({"minutes": minutes, **errors(predict)})
            print(self.rows[-1], flush=True)
            self._paused += time.monotonic() - paused
        return self.elapsed < self.minutes


@jax.jit
def _observe(joints, subgoal: Subgoal, pose):
    return tracker_observation(joints, relative(CONFIG.families, subgoal, pose), CONFIG.families)


def errors(predict: Predict) -> dict[str, float]:
    """Median errors on held-out goals and speeds."""
    rng, (goal, velocity) = np.random.default_rng(2**31 - 1), FAMILIES
    value = [rng.uniform(goal.range.low[0], goal.range.high[0], COMMANDS), speeds_within(velocity.range, COMMANDS, rng)]
    slot = np.repeat([CONFIG.families.index(family.name) for family in FAMILIES], COMMANDS).astype(np.int32)
    subgoal = Subgoal(slot, np.concatenate(value).astype(np.float32)[:, None])

    def control_step(batch: RobotBatch) -> None:
        batch.step(predict(np.asarray(_observe(batch.proprioception(), subgoal, batch.pose().astype(np.float32)))))

    states, _ = run_robots(SPEC, len(slot), control_step)
    found = final_error(CONFIG.families, Task(slot, subgoal.value), states)
    return {name: float(np.median(found[slot == CONFIG.families.index(name)])) for name in FAMILIES.names}


def learn_ours(clock: Clock, seed: int) -> None:
    batch = RobotBatch(SPEC, CONFIG.robots)
    batch.reset(np.random.default_rng((seed, 1)))
    learner, predict = TrackerLearner(SPEC, CONFIG), jax.jit(lambda actor, o: actor(o))
    state = off_policy.initial_state(learner, batch, jax.random.key(seed))
    going = True
    while going:
        state, _ = off_policy.iterate(state, learner, batch, seed)
        actor = state.sac.averaged_actor
        going = clock.tick(lambda observation, actor=actor: np.asarray(predict(actor, observation)))


def learn_theirs(library: str, clock: Clock, seed: int) -> None:
    import gymnasium
    from stable_baselines3.common.callbacks import BaseCallback

    if library == "sb3":
        from stable_baselines3 import SAC
    else:
        from sbx import SAC

    class Watch(BaseCallback):
        def _on_step(self) -> bool:
            return clock.tick(lambda observation: self.model.predict(observation, deterministic=True)[0])

    model = SAC("MlpPolicy", gymnasium.make(ENVIRONMENT), seed=seed, device="cpu", verbose=0)
    model.learn(10**9, callback=Watch())


def draw(curves: dict[str, list[dict[str, float]]], path: Path) -> None:
    with figure(path, 1, 2, size=(10.0, 4.0)) as (_, panels):
        for axes, slot, unit in zip(panels, ("goal", "velocity"), ("m", "m/s"), strict=True):
            for name, rows in curves.items():
                axes.plot([row["minutes"] for row in rows], [row[slot] for row in rows], "o-", label=name)
            axes.set(xlabel="wall time [min]", ylabel=f"{slot}: median error [{unit}]", yscale="log")
            axes.legend(frameon=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--learners", nargs="+", default=["ours", "sb3", "sbx"], choices=["ours", "sb3", "sbx"])
    parser.add_argument("--out", type=Path, default=Path("runs/tracker-benchmark"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--alone", action="store_true", help="in this process, without the table")
    arguments = parser.parse_args()
    if arguments.alone:
        name, clock = arguments.learners[0], Clock(arguments.minutes)
        learn_ours(clock, arguments.seed) if name == "ours" else learn_theirs(name, clock, arguments.seed)
        (arguments.out / f"{name}.json").write_text(json.dumps(clock.rows, indent=1))
        return
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.learners:
        flags = ["--alone", "--learners", name, "--minutes", str(arguments.minutes), "--out", str(arguments.out)]
        with tempfile.TemporaryDirectory() as cache:  # each compiles for itself
            subprocess.run(
                [sys.executable, __file__, *flags, "--seed", str(arguments.seed)],
                check=True,
                env={**os.environ, "JAX_COMPILATION_CACHE_DIR": cache},
            )
    curves = {name: json.loads((arguments.out / f"{name}.json").read_text()) for name in arguments.learners}
    draw(curves, arguments.out / "tracker.png")
    print(f"| minutes | {' | '.join(f'{name} goal | {name} velocity' for name in curves)} |")
    print("|---" * (2 * len(curves) + 1) + "|")
    for i in range(max(len(rows) for rows in curves.values())):
        cells = [
            f"{rows[i][slot]:.3f}" if i < len(rows) else "" for rows in curves.values() for slot in ("goal", "velocity")
        ]
        print(f"| {i + 1} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
