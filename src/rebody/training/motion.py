"""How training moves a batch of robots: the places that read and write its positions, and what a step was worth."""

from collections.abc import Callable

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies import RobotBatch
from rebody.bodies.robot import Reach
from rebody.control.tracker import Command, Motion, TrackerReward, relative, tracker_observation, tracker_reward
from rebody.types import GlobalState, Subgoal, Task


def decision(
    batch: RobotBatch, control_step: Callable[[int], object]
) -> tuple[GlobalState, Bool[np.ndarray, " robot"]]:
    """Move robots by the control steps of a decision; their state after it, and which of them fell."""
    before, fell = batch.qpos.copy(), np.zeros(batch.size, bool)
    for step in range(batch.spec.steps_per_decision):
        control_step(step)
        fell |= batch.fallen
    return batch.spec.observe(batch.qpos, before), fell


class LastDecision(eqx.Module):
    """Where robots were when their last decision began; written in place."""

    qpos: Float[np.ndarray, "robot nq"]

    @classmethod
    def of(cls, batch: RobotBatch) -> "LastDecision":
        """It begins now."""
        return cls(batch.qpos.copy())

    def next(self, batch: RobotBatch) -> GlobalState:
        """The state of robots at the end of it; the next one begins."""
        state = batch.spec.observe(batch.qpos, self.qpos)
        self.qpos[:] = batch.qpos
        return state

    def restart(self, batch: RobotBatch, who: Bool[np.ndarray, " robot"] | slice = slice(None)) -> None:
        """Those robots were set down where they are."""
        self.qpos[who] = batch.qpos[who]


def put_on_feet(batch: RobotBatch, rng: np.random.Generator) -> None:
    """A robot that has fallen is put on its feet where it lies: episode and belief go on."""
    fallen, x = batch.fallen, batch.x
    batch.reset(rng, fallen)
    batch.place(x[fallen], who=fallen)


def motion_of(batch: RobotBatch, before: Float[np.ndarray, "robot nq"]) -> Motion:
    """What the control step did that began with the joint positions `before`."""
    x, z, pitch = batch.spec.root_addresses
    moved = (batch.qpos - before).astype(np.float32)
    pitch_now = batch.spec.pitch(batch.qpos).astype(np.float32)
    filtered_speed = batch.pace.astype(np.float32)
    return Motion(moved[:, x], moved[:, pitch], pitch_now, filtered_speed, batch.fallen, moved[:, z])


def no_command(size: int) -> Command:
    """To stay, for so many robots."""
    return Command(np.zeros(size, np.int32), np.zeros(size, np.float32))


def tracker_features(batch: RobotBatch, reach: Reach) -> int:
    """Numbers that a tracker sees."""
    return tracker_observation(batch.proprioception(), no_command(batch.size), reach).shape[-1]


def privileged_reward(
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
