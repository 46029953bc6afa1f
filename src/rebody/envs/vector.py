"""Many bodies, each with a hidden task, stepped together."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from rebody import inputs
from rebody.envs.bodies import Bodies
from rebody.envs.world import DEFAULT_BASE_TASKS, World
from rebody.tasks import BaseTask


class TaskVectorEnv(VectorEnv):
    """What `SyncVectorEnv` makes of `TaskEnv`, number for number, and faster."""

    def __init__(
        self,
        bodies: Bodies,
        *,
        max_episode_steps: int | None = None,
        base_tasks: Sequence[BaseTask] = DEFAULT_BASE_TASKS,
        reward: str = "plain",
        render_mode: str | None = None,
    ):
        """As `TaskEnv`; episodes end after `max_episode_steps`, never where that is None."""
        self._world = World(bodies, base_tasks, reward)
        self._max_episode_steps = math.inf if max_episode_steps is None else max_episode_steps
        self._rngs = [seeding.np_random()[0] for _ in range(bodies.size)]
        self._steps = np.zeros(bodies.size, np.int64)
        self._ended = np.zeros(bodies.size, np.bool_)
        self.num_envs = bodies.size
        self.render_mode = render_mode
        self.single_observation_space = self._world.observation_space
        self.single_action_space = self._world.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """The generator of each body."""
        return tuple(self._rngs)

    def reset(self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None):
        """Start all anew; an integer seeds body i with seed + i; `options` may name the task of all."""
        if seed is not None:
            seeds = range(seed, seed + self.num_envs) if isinstance(seed, int) else seed
            self._rngs = [seeding.np_random(s)[0] for s in seeds]
        for body, rng in enumerate(self._rngs):
            self._world.reset(body, rng, options)
        self._steps[:] = 0
        self._ended[:] = False
        return self._world.observations(), self._info()

    def step(self, actions: Any):
        """One step of all; a body whose episode ended is reset instead, with a reward of 0 (NEXT_STEP).

        RebodyError, and none moves, for NaN or another shape.
        """
        actions = inputs.numbers(actions, (self.num_envs, self._world.bodies.actions), "the array of actions")
        started = self._ended
        self._world.bodies.step(actions)
        for body in np.flatnonzero(started):
            self._world.reset(int(body), self._rngs[body])
        self._steps = np.where(started, 0, self._steps + 1)
        self._ended = self._steps >= self._max_episode_steps
        rewards = np.where(started, 0.0, self._world.rewards())
        terminated = np.zeros(self.num_envs, np.bool_)
        return self._world.observations(), rewards, terminated, self._ended.copy(), self._info()

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of each body, where `render_mode` is "rgb_array"."""
        return self._world.pictures() if self.render_mode == "rgb_array" else None

    def close_extras(self, **kwargs: Any) -> None:
        """Release the camera."""
        self._world.close()

    def _info(self) -> dict[str, Any]:
        # Gymnasium's convention: beside every entry, a mask of the bodies that have it
        present = {f"_{name}": np.ones(self.num_envs, np.bool_) for name in self._world.info()}
        return self._world.info() | present
