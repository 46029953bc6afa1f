"""One body with a hidden task: a world of one."""

from typing import Any

import gymnasium
import numpy as np

from rebody import inputs
from rebody.bodies import Simulation
from rebody.envs.seeds import body_seed
from rebody.envs.world import DEFAULT_FAMILIES, World, task_of_options


class TaskEnv(gymnasium.Env):
    """Never terminates; the task is in `info`, not in the observation."""

    def __init__(
        self,
        bodies: Simulation,
        *,
        families: Any = DEFAULT_FAMILIES,
        render_mode: str | None = None,
    ):
        """Tasks are drawn from the targets of a `FamilySet` unless `reset` is told one; its laws say what is paid."""
        self._world = World(bodies, families)
        self.render_mode = render_mode
        self.observation_space = self._world.observation_space
        self.action_space = self._world.action_space

    def reset(self, *, seed: Any = None, options: Any = None):
        """Start anew; `options` may name the task: {"family": "goal", "target": -3.0}.

        RebodyError, and nothing is reset, for other options or a seed that is none.
        """
        task = task_of_options(options, self._world.families)
        super().reset(seed=body_seed(seed))
        self._world.reset(0, self.np_random, task)
        return self._world.observations()[0], self._info()

    def step(self, action: Any):
        """One step with an action in [-1, 1]; larger ones are clipped.

        RebodyError, and nothing moves, for NaN or another shape, and before the first reset.
        """
        self._world.step(inputs.numbers(action, self._world.action_space.shape, "the action")[None])
        reward = float(self._world.rewards()[0])
        return self._world.observations()[0], reward, False, False, self._info()

    def render(self) -> np.ndarray | None:
        """A picture from a camera that follows the body, where `render_mode` is "rgb_array"."""
        return self._world.pictures()[0] if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Release the camera, which is all that is held; may be called twice."""
        self._world.close()

    def _info(self) -> dict[str, Any]:
        """Plain numbers; the target is an array of as many as its family has."""
        told = self._world.info()
        plain = {name: values[0] if values.ndim > 1 else values.tolist()[0] for name, values in told.items()}
        return plain | {"target": plain["target"][: self._world.families.named(plain["family"]).size]}
