"""How training moves a batch of robots, and what a control step was worth."""

from collections.abc import Callable

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies import RobotBatch
from rebody.control.command import YAW, Command, Motion, addressed, relative, slots_among
from rebody.control.tracker import TrackerReward, tracker_observation, tracker_reward
from rebody.tasks import FamilySet
from rebody.tasks.quantities import turned, wrapped
from rebody.types import ANGLES, POSE_FIELDS, GlobalState, Pose, Subgoal, Task

ATTITUDE = slice(len(POSE_FIELDS) - len(ANGLES), None)
"""Where the angles of a pose stand."""


def decision(
    batch: RobotBatch, control_step: Callable[[int], object]
) -> tuple[GlobalState, Bool[np.ndarray, " robot"]]:
    """Move robots by the control steps of a decision; their state after it, and which of them fell."""
    fell = np.zeros(batch.size, bool)
    for step in range(batch.steps_per_decision):
        control_step(step)
        fell |= batch.fallen
    return batch.observe(), fell


def put_on_feet(batch: RobotBatch, rng: np.random.Generator) -> None:
    """A robot that has fallen is put on its feet where it lies: episode and belief go on."""
    fallen, pose = batch.fallen, batch.pose()
    batch.reset(rng, fallen)
    x, y, yaw = (pose[fallen, POSE_FIELDS.index(name)] for name in ("x", "y", "yaw"))
    batch.place(x, y, yaw, fallen)


def motion_of(batch: RobotBatch, before: Float[np.ndarray, "robot 6"]) -> Motion:
    """What the control step did that began in the poses `before`."""
    pose = batch.pose()
    moved = pose - before
    moved[:, ATTITUDE] = wrapped(moved[:, ATTITUDE])
    moved[:, 0], moved[:, 1] = turned(moved[:, 0], moved[:, 1], -before[:, YAW], np)
    velocity = moved / batch.step_s
    velocity[:, 0] = batch.pace
    displacement, now, speed = (numbers.astype(np.float32) for numbers in (moved, pose, velocity))
    return Motion(displacement, now, speed, batch.fallen)


def no_command(size: int, families: FamilySet) -> Command:
    """To stay, for so many robots."""
    return Command(np.zeros(size, np.int32), np.zeros((size, families.size), np.float32))


def tracker_features(batch: RobotBatch, families: FamilySet) -> int:
    """Numbers that a tracker sees."""
    return tracker_observation(batch.proprioception(), no_command(batch.size, families), families).shape[-1]


def privileged_reward(
    batch: RobotBatch,
    before: Float[np.ndarray, "robot 6"],
    task: Task,
    action: Float[np.ndarray, "robot action"],
    families: FamilySet,
    commands: FamilySet,
    weights: TrackerReward,
) -> Float[np.ndarray, " robot"]:
    """What a tracker of those commands would be paid for the control step that led here from the poses `before`, were
    it told the task, which is one of `families`.
    """
    wanted = addressed(Subgoal(np.asarray(task.family), np.asarray(task.target)), slots_among(families, commands))
    motion, pose = motion_of(batch, before), before.astype(np.float32)
    return np.asarray(_paid(wanted, pose, motion, action, batch.step_s, commands, weights))


@eqx.filter_jit
def _paid(
    wanted: Subgoal, pose: Pose, motion: Motion, action, step_s: float, commands: FamilySet, weights: TrackerReward
):
    return tracker_reward(relative(commands, wanted, pose), motion, step_s, action, commands, weights)
