"""A control step on four robots that walk by their makers' policies: milliseconds of `agent.step` and of the policy.

    .venv/bin/python benchmarks/real_time.py [--repetitions 5] [--seconds 20]

Needs REBODY_MAKERS (docs/walking-robots.md), and Linux: all runs on one core. Every 0.1 s a step has a decision in it,
with sharpening and imagination. The physics is not counted. Other work on the machine only adds: the best of several
runs, each from the start, and beside it the processor's own time. Exit code 1 where a p99 is not below 5 ms; a control
step has 20.
"""

import argparse
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

import rebody
from rebody.bodies import RobotSpec, load_robot, simulate
from rebody.bodies.walking.policy import WalkingPolicy

WALKING = Path(__file__).parents[1] / "examples" / "walking"
ROBOTS = ("go1", "t1", "berkeley", "g1")
PLACE, FLOOR = np.array([3.0, -2.0]), 2.5
BOUND_MS = 5.0
WARM = 100
"""Control steps that are not counted: everything is compiled in them."""


@dataclass(frozen=True)
class Times:
    """Of each control step of one run [ms]."""

    all: Float[np.ndarray, " step"]
    """The agent and the policy together."""
    policy: Float[np.ndarray, " step"]
    """The policy alone."""
    processor: Float[np.ndarray, " step"]
    """Of both, the processor's."""
    every: int
    """Steps from one decision to the next."""


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20.0)
    said = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})  # threads that begin from here on stay there, too
    title = f"ms of a control step of 20 ms; best of {said.repetitions} runs of {said.seconds:g} s each"
    table, is_late = Table("robot", title=title), False
    for column in ("p50", "p99", "with a decision: p50", "p99", "processor: p99", "the policy alone: p50"):
        table.add_column(column, justify="right")
    for name in ROBOTS:
        spec = load_robot(str(WALKING / f"{name}.toml"))
        runs = [run(name, spec, said.seconds) for _ in range(said.repetitions)]
        best = [min(percentile(each) for each in runs) for percentile in FIGURES]
        table.add_row(name, *(f"{each:.2f}" for each in best))
        is_late |= best[1] >= BOUND_MS
    Console().print(table)
    sys.exit(is_late)


FIGURES = (
    lambda run: np.median(run.all),
    lambda run: np.percentile(run.all, 99),
    lambda run: np.median(run.all[:: run.every]),
    lambda run: np.percentile(run.all[:: run.every], 99),
    lambda run: np.percentile(run.processor, 99),
    lambda run: np.median(run.policy),
)


def run(name: str, spec: RobotSpec, seconds: float) -> Times:
    """One episode of `reuse` towards a hidden place."""
    assert spec.walking is not None
    agent = rebody.load_agent(str(WALKING / f"{name}.toml"), "plane")
    body = simulate(spec, 1)
    body.reset(np.random.default_rng(0))
    # beside the body's own policy, which steps within its physics
    policy = WalkingPolicy(spec.name, spec.walking, spec.model, spec.rest_qpos, spec.root_body)
    gait, reward, taken = policy.begin(1), None, []
    for _ in range(WARM + round(seconds / spec.control_dt)):
        observation = body.observation()[0]
        qpos, qvel = np.split(observation, [spec.model.nq])
        begun, begun_cpu = time.perf_counter(), time.process_time()
        action = agent.step(observation, reward)
        between = time.perf_counter()
        command = spec.walking.joystick.command(action[None])
        policy.step(gait, qpos[None], qvel[None], command, spec.control_dt)
        ended, ended_cpu = time.perf_counter(), time.process_time()
        taken.append((ended - begun, ended - between, ended_cpu - begun_cpu))
        body.step(action[None])
        reward = -float(np.linalg.norm(body.pose()[0, :2] - PLACE)) / max(FLOOR, float(np.linalg.norm(PLACE)))
    both, alone, processor = 1e3 * np.array(taken[WARM:]).T
    return Times(both, alone, processor, spec.steps_per_decision)


if __name__ == "__main__":
    main()
