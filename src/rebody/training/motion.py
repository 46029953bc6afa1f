"""What a control step did to robots, and what that is worth to one that is told a task."""

import equinox as eqx
import numpy as np
from jaxtyping import Float

from rebody.bodies import RobotBatch
from rebody.bodies.robot import Reach
from rebody.control.tracker import Motion, TrackerReward, relative, tracker_reward
from rebody.types import Subgoal, Task


def motion_of(batch: RobotBatch, before: Float[np.ndarray, "robot nq"]) -> Motion:
    """What the control step did that began with the joint positions `before`."""
    x, z, pitch = batch.spec.root_addresses
    moved = (batch.qpos - before).astype(np.float32)
    pitch_now = batch.spec.pitch(batch.qpos).astype(np.float32)
    pace = batch.pace.astype(np.float32)
    return Motion(moved[:, x], moved[:, pitch], pitch_now, pace, batch.fallen, moved[:, z])


def told_reward(
    batch: RobotBatch,
    before: Float[np.ndarray, "robot nq"],
    task: Task,
    action: Float[np.ndarray, "robot action"],
    weights: TrackerReward,
) -> Float[np.ndarray, " robot"]:
    """What a tracker would be paid for the control step that led here from `before`, were it told the task."""
    spec = batch.spec
    x, _, pitch = before[:, spec.root_addresses].astype(np.float32).T
    wanted, motion = Subgoal(np.asarray(task.family), np.asarray(task.target)), motion_of(batch, before)
    return np.asarray(_paid(wanted, x, pitch, motion, action, spec.control_dt, spec.reach, weights))


@eqx.filter_jit
def _paid(wanted: Subgoal, x, pitch, motion: Motion, action, control_dt: float, reach: Reach, weights: TrackerReward):
    return tracker_reward(relative(wanted, x, pitch), motion, control_dt, action, reach, weights)
