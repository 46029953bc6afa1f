"""The standard tasks of the field: a frozen module and a tracker in environments with the published rewards.

    .venv/bin/python benchmarks/standard.py [cheetah-vel ...] [--inference MODULE] [--robot ROBOT] [--json FILE]

Test tasks, two episodes each: what was learned of a task in the first is remembered in the second. Returns are the
environment's own. Beside `reuse` the oracle, which is told the task and has the same tracker, and idle.
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from standard_bodies import in_environments

from rebody.agents.agent import Observation
from rebody.agents.clock import begin, decide, pass_over
from rebody.agents.parts import load_inference, load_tracker, tracker_of
from rebody.agents.rollout import follow
from rebody.bodies import RobotSpec, load_robot
from rebody.errors import RebodyError
from rebody.evaluation.evaluate import narrowed, trial_agent, trial_controller
from rebody.evaluation.statistics import percentile_95, regret, with_interval
from rebody.evaluation.trial import Trial, check_trial
from rebody.jax_settings import own_jax_settings
from rebody.standard import draws
from rebody.store import load_artifact
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec, active_tasks
from rebody.types import POSE_FIELDS

AGENTS = ("reuse", "oracle", "idle")
EPISODES = 2
Told = tuple[str, tuple[float, ...]]
"""A task in our words: family and target."""


@dataclass(frozen=True)
class Standard:
    """One of the field's benchmarks."""

    environment: str
    tasks: draws.TaskSet
    told: Callable[[Any], Told]
    steps: int
    robot: str = "cheetah"
    inference: str = "goal-velocity"
    settles_s: float = 1.0
    """A final speed is the mean over so long."""


def of_melts(task: Any) -> Told:
    """Families have the first word's name, but for flips, which are none of ours."""
    return task[0].split("_")[0], (task[1],)


STANDARD = {
    "cheetah-vel": Standard("CheetahVel", draws.speeds(), lambda task: ("velocity", (task,)), 200),
    "amago": Standard("AmagoCheetahVel", draws.speeds(), lambda task: ("velocity", (task,)), 1000, settles_s=2.5),
    "melts": Standard("MeltsCheetah", draws.base_tasks(), of_melts, 200),
    "ant-goal": Standard("AntGoal", draws.places(), lambda task: ("place", task), 200, "ant", "plane"),
}
LAST_S = 2.0
"""A final place or attitude is judged over so long."""


@dataclass(frozen=True)
class Played:
    """What one agent did, in its first and its second episode of each task."""

    returns: Float[np.ndarray, "episode task"]
    final_errors: Float[np.ndarray, "episode task"]  # m, m/s, rad
    families: list[str]
    """What it believed at the end; of oracle and idle nothing that counts."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(STANDARD)} (default: all)")
    parser.add_argument("--inference", help="shipped name or folder (default: goal-velocity, of ant-goal plane)")
    parser.add_argument("--robot", help="name or TOML file (default: cheetah, of ant-goal ant)")
    parser.add_argument("--tasks", type=int, default=40, help="test tasks at most, the first ones")
    parser.add_argument("--no-costs", action="store_true", help="agents do not hear costs; returns still have them")
    parser.add_argument("--json", type=Path, help="file for every episode")
    options = parser.parse_args()
    measured = []
    for name in options.names or STANDARD:
        try:
            measured.append(measure(name, options))
        except RebodyError as error:
            print(f"{name}: left out, {error}", file=sys.stderr)
        else:
            print_tables(measured[-1])
    if options.json is not None:
        options.json.write_text(json.dumps(measured, indent=1))


@own_jax_settings()
def measure(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Every agent on the test tasks; RebodyError where parts are missing, or do not fit."""
    if name not in STANDARD:
        raise RebodyError(f"there is no such benchmark; choose of {', '.join(STANDARD)}.")
    standard = STANDARD[name]
    spec = load_robot(options.robot or standard.robot)
    tracker = load_tracker(tracker_of(spec))
    trial = Trial(
        agent="reuse",
        inference=load_inference(options.inference or standard.inference),
        families=SHIPPED,
        robot=spec,
        tracker=tracker,
        slots_by="belief",
        sharpen=True,
        seconds=standard.steps * spec.control_dt,
    )
    families = {*trial.contract.families.names} & {*tracker.tracker.families.names}
    known = [task for task in standard.tasks.test if standard.told(task)[0] in families]
    tasks = known[: options.tasks]
    specs = [TaskSpec(*standard.told(task)) for task in tasks]
    trial = narrowed(trial, specs)
    check_trial(trial, specs)
    played = {agent: play(standard, replace(trial, agent=agent), tasks, specs, options.no_costs) for agent in AGENTS}
    return {
        "benchmark": name,
        "environment": standard.environment,
        "robot": spec.name,
        "inference": trial.inference.name,
        "hears": "the task alone" if options.no_costs else "the reward",
        "robot_steps": {"training": training_steps(spec), "of an episode": standard.steps},
        "left_out": [task for task in standard.tasks.test if task not in known],
        "tasks": tasks,
        "groups": [group_of(task, spec) for task in specs],
        "agents": {
            agent: {
                "returns": of.returns.tolist(),
                "final_errors": of.final_errors.tolist(),
                "believed_families": of.families,
            }
            for agent, of in played.items()
        },
    }


def play(standard: Standard, trial: Trial, tasks: Sequence[Any], specs: list[TaskSpec], no_costs: bool) -> Played:
    """Two episodes of each task. Between them the robot is put back, and nothing is forgotten: the agent's memory goes
    on, and the jump to the new start counts as a decision in which nothing was heard.
    """
    assert trial.robot is not None
    robots = in_environments(trial.robot, f"rebody-standard/{standard.environment}-v0", len(tasks))
    agent = trial_agent(trial, active_tasks(specs, trial.in_play, 1, trial.robot.control_dt))
    controller, per_decision = trial_controller(trial), robots.steps_per_decision
    carry, returns, errors = None, [], []
    for episode in range(EPISODES):
        robots.start(tasks, [EPISODES * i + episode for i in range(len(tasks))])
        state = robots.observe()
        carry, _ = begin(agent, state) if carry is None else pass_over(agent, carry, state)
        paid, heard, poses = [], [], [robots.pose()]
        for step in range(1, standard.steps + 1):
            follow(controller, robots, carry.command.subgoal, carry.belief)
            paid.append(robots.rewards)
            heard.append(robots.task_rewards if no_costs else robots.rewards)
            poses.append(robots.pose())
            if step % per_decision == 0:
                mean = np.mean(heard[-per_decision:], axis=0, dtype=np.float32)
                carry, _ = decide(agent, carry, Observation(robots.observe(), mean))
        returns.append(np.sum(paid, axis=0))
        errors.append(final_errors(standard, specs, np.array(poses), trial.robot.control_dt))
    assert carry is not None
    which, _ = agent.reader(carry.belief)
    return Played(np.array(returns), np.array(errors), [trial.in_play[i].name for i in np.asarray(which)])


def final_errors(
    standard: Standard, specs: list[TaskSpec], poses: Float[np.ndarray, "step task 6"], dt: float
) -> Float[np.ndarray, " task"]:
    """How far each is from its target in the end [m, m/s, rad]."""
    moment, last = round(standard.settles_s / dt), round(LAST_S / dt)
    speed = (poses[-1] - poses[-1 - moment]) / standard.settles_s
    errors = []
    for i, spec in enumerate(specs):
        if spec.family == "velocity":
            errors.append(abs(speed[i, 0] - spec.target[0]))
            continue
        fields = {"goal": ("x",), "stand": ("pitch",), "place": ("x", "y")}[spec.family]
        of_pose = poses[-last:, i][:, [POSE_FIELDS.index(field) for field in fields]]
        errors.append(np.mean(np.linalg.norm(of_pose - spec.target, axis=-1)))
    return np.array(errors)


def group_of(spec: TaskSpec, robot: RobotSpec) -> str:
    """Tasks that are listed together: of a family, speeds beyond what the tracker was trained for apart."""
    reach = dict(robot.reach).get(spec.family)
    if spec.family != "velocity" or reach is None or reach.low[0] <= spec.target[0] <= reach.high[0]:
        return spec.family
    return f"{spec.family} beyond {reach.low[0]:g} to {reach.high[0]:g} m/s"


def training_steps(spec: RobotSpec) -> int:
    """Control steps that the robot took in the training of its tracker, or of its walking policy."""
    name, kind = (tracker_of(spec), "tracker") if spec.walking is None else (spec.walking.artifact, "walking")
    if name is None:
        return 0  # a maker's own: nobody says
    training = load_artifact(name, kind).config["training"]
    return training["robots"] * training["steps"] * training["iterations"]


def print_tables(measured: dict[str, Any]) -> None:
    """In Markdown: a row for each agent and group of tasks."""
    print(f"\n{measured['benchmark']}: {measured['robot']}, {measured['inference']}, hears {measured['hears']}\n")
    print("| tasks | agent | return, first episode | second episode | final error, first: median / p95 | second |")
    print("|---|---|---|---|---|---|")
    groups = np.array(measured["groups"])
    for group in dict.fromkeys(measured["groups"]):
        chosen = np.flatnonzero(groups == group)
        for agent, of in measured["agents"].items():
            returns, errors = (np.array(of[what])[:, chosen] for what in ("returns", "final_errors"))
            cells = [said(each) for each in returns] + [f"{np.median(e):.3f} / {percentile_95(e):.3f}" for e in errors]
            print(f"| {group} ({len(chosen)}) | `{agent}` | {' | '.join(cells)} |")
        reached, possible = (np.array(measured["agents"][agent]["returns"])[:, chosen] for agent in AGENTS[:2])
        lost = [f"{100 * regret(np.stack(pair, axis=-1)):.1f} %" for pair in zip(reached, possible, strict=True)]
        print(f"| {group} ({len(chosen)}) | lost to the oracle | {' | '.join(lost)} | | |")
    steps = measured["robot_steps"]
    print(f"\nRobot steps: {steps['training']:,} in training, {steps['of an episode']:,} in an episode of a test task.")
    if measured["left_out"]:
        names = ", ".join(dict.fromkeys(str(task[0]) for task in measured["left_out"]))
        print(f"Left out, since module or tracker has no such family: {names}.")


def said(returns: Float[np.ndarray, " task"]) -> str:
    """Mean and its interval over tasks."""
    mean = with_interval(returns, np.mean)
    return f"{mean['value']:.1f} [{mean['low']:.1f}, {mean['high']:.1f}]"


if __name__ == "__main__":
    main()
