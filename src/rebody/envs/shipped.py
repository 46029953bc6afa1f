"""The environments that Gymnasium knows by name: each body alone, and many of it."""

from typing import Any

from gymnasium.vector import AutoresetMode

from rebody.bodies import load_robot
from rebody.envs.bodies import PointMasses, Robots
from rebody.envs.single import TaskEnv
from rebody.envs.vector import TaskVectorEnv

_POINT_MASS = {"render_modes": ["rgb_array"], "render_fps": 10}
_CHEETAH = {"render_modes": ["rgb_array"], "render_fps": 20}
_NEXT_STEP = {"autoreset_mode": AutoresetMode.NEXT_STEP}


class PointMassEnv(TaskEnv):
    """A mass-damper along x: observation [x, vx], one action, steps of 0.1 s."""

    metadata = _POINT_MASS

    def __init__(self, **settings: Any):
        """Settings as `TaskEnv` has them."""
        super().__init__(PointMasses(1), **settings)


class PointMassVectorEnv(TaskVectorEnv):
    """Many mass-dampers."""

    metadata = _POINT_MASS | _NEXT_STEP

    def __init__(self, num_envs: int = 1, **settings: Any):
        """Settings as `TaskVectorEnv` has them."""
        super().__init__(PointMasses(num_envs), **settings)


class HalfCheetahEnv(TaskEnv):
    """HalfCheetah: observation qpos with x, then qvel; six joint actions; steps of 0.05 s."""

    metadata = _CHEETAH

    def __init__(self, **settings: Any):
        """Settings as `TaskEnv` has them."""
        super().__init__(Robots(load_robot("cheetah"), 1, threads=1), **settings)


class HalfCheetahVectorEnv(TaskVectorEnv):
    """Many HalfCheetahs, stepped on several threads."""

    metadata = _CHEETAH | _NEXT_STEP

    def __init__(self, num_envs: int = 1, threads: int = 0, **settings: Any):
        """`threads` = 0 uses every processor; settings as `TaskVectorEnv` has them."""
        super().__init__(Robots(load_robot("cheetah"), num_envs, threads), **settings)
