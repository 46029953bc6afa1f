"""The environments that Gymnasium knows by name: each body alone, and many of it."""

from typing import Any

from gymnasium.vector import AutoresetMode

from rebody.bodies import PointMasses, RobotSpec, load_robot, simulate
from rebody.bodies.toys import MassDamper
from rebody.envs.single import TaskEnv
from rebody.envs.vector import TaskVectorEnv

_PICTURES = {"render_modes": ["rgb_array"]}
_POINT_MASS = _PICTURES | {"render_fps": 10}
_NEXT_STEP = {"autoreset_mode": AutoresetMode.NEXT_STEP}


class PointMassEnv(TaskEnv):
    """A mass-damper along x: observation [x, vx], one action, steps of 0.1 s."""

    metadata = _POINT_MASS

    def __init__(self, **settings: Any):
        """Settings as `TaskEnv` has them."""
        super().__init__(PointMasses(MassDamper(), 1), **settings)


class PointMassVectorEnv(TaskVectorEnv):
    """Many mass-dampers."""

    metadata = _POINT_MASS | _NEXT_STEP

    def __init__(self, num_envs: int = 1, **settings: Any):
        """Settings as `TaskVectorEnv` has them."""
        super().__init__(PointMasses(MassDamper(), num_envs), **settings)


class RobotEnv(TaskEnv):
    """A robot: observation qpos with x, then qvel; an action per actuator; a step is its control step."""

    metadata = _PICTURES

    def __init__(self, robot: str, **settings: Any):
        """`robot` is a shipped name or the path of a TOML file; settings as `TaskEnv` has them."""
        spec = load_robot(robot)
        self.metadata = _robot_metadata(spec)
        super().__init__(simulate(spec, 1, threads=1), **settings)


class RobotVectorEnv(TaskVectorEnv):
    """Many robots, stepped on several threads."""

    metadata = _PICTURES | _NEXT_STEP

    def __init__(self, robot: str, num_envs: int = 1, threads: int = 0, **settings: Any):
        """`threads` = 0 uses every processor; the rest as for `RobotEnv` and `TaskVectorEnv`."""
        spec = load_robot(robot)
        self.metadata = _robot_metadata(spec) | _NEXT_STEP
        super().__init__(simulate(spec, num_envs, threads), **settings)


def _robot_metadata(spec: RobotSpec) -> dict[str, Any]:
    return _PICTURES | {"render_fps": round(1 / spec.control_dt)}
