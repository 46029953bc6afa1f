"""What a control step did to robots."""

import numpy as np
from jaxtyping import Float

from rebody.bodies import RobotBatch
from rebody.control.tracker import Motion


def motion_of(batch: RobotBatch, before: Float[np.ndarray, "robot nq"]) -> Motion:
    """What the control step did that began with the joint positions `before`."""
    x, _, pitch = batch.spec.root_addresses
    moved = (batch.qpos - before).astype(np.float32)
    pitch_now = batch.spec.pitch(batch.qpos).astype(np.float32)
    return Motion(moved[:, x], moved[:, pitch], pitch_now, batch.pace.astype(np.float32), batch.fallen)
