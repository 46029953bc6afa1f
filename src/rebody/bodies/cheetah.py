"""HalfCheetah, from Gymnasium's MJCF."""

from pathlib import Path

import gymnasium
import numpy as np

from rebody.bodies.robot import RobotSpec

GYMNASIUM_ASSETS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"


def cheetah() -> RobotSpec:
    """HalfCheetah with Gymnasium's frame skip: a control step of 0.05 s; fallen when on its back for 1 s."""
    return RobotSpec(
        name="cheetah",
        mjcf=GYMNASIUM_ASSETS / "half_cheetah.xml",
        frame_skip=5,
        root_joints=("rootx", "rootz", "rooty"),
        reset_noise=0.1,
        has_fallen=lambda height, pitch: np.abs(pitch) > 2.0,
        fall_duration=1.0,
    )
