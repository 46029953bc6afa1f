"""Many bodies, each with a hidden task, stepped together."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Bool

from rebody import inputs
from rebody.bodies import Simulation
from rebody.envs.seeds import body_seeds
from rebody.envs.world import DEFAULT_FAMILIES, World, task_of_options
from rebody.errors import RebodyError
from rebody.tasks import FamilySet
from rebody.types import Task


class TaskVectorEnv(VectorEnv):
    """What `SyncVectorEnv` makes of `TaskEnv`, number for number, and faster."""

    def __init__(
        self,
        bodies: Simulation,
        *,
        max_episode_steps: int | None = None,
        families: Any = DEFAULT_FAMILIES,
        render_mode: str | None = None,
    ):
        """As `TaskEnv`; episodes end after `max_episode_steps`, never where that is None."""
        self._world = World(bodies, families)
        self._max_episode_steps = math.inf if max_episode_steps is None else max_episode_steps
        self._seeded = [seeding.np_random() for _ in range(bodies.size)]
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
        return tuple(rng for rng, _ in self._seeded)

    @property
    def np_random_seed(self) -> tuple[int, ...]:
        """The seed of each body's generator."""
        return tuple(seed for _, seed in self._seeded)

    def reset(self, *, seed: Any = None, options: Any = None):
        """Start all anew, or those of `options["reset_mask"]`, a boolean array, and leave the others as they are.

        An integer seeds body i with seed + i, a list has a seed of each body. `options` may name the task of all.
        RebodyError, and nothing is reset, for other options or seeds.
        """
        chosen, task = _what_to_reset(options, self.num_envs, self._world.families)
        seeds = body_seeds(seed, self.num_envs)
        for body in np.flatnonzero(chosen):
            if seeds[body] is not None:
                self._seeded[body] = seeding.np_random(seeds[body])
            self._world.reset(int(body), self.np_random[body], task)
        self._steps[chosen] = 0
        self._ended = self._ended & ~chosen
        return self._world.observations(), self._info(chosen)

    def step(self, actions: Any):
        """One step of all; a body whose episode ended is reset instead, with a reward of 0 (NEXT_STEP).

        RebodyError, and none moves, for NaN or another shape, and before the first reset.
        """
        actions = inputs.numbers(actions, (self.num_envs, self._world.bodies.actions), "the array of actions")
        started = self._ended
        self._world.step(actions)
        for body in np.flatnonzero(started):
            self._world.reset(int(body), self.np_random[body])
        self._steps = np.where(started, 0, self._steps + 1)
        self._ended = self._steps >= self._max_episode_steps
        rewards = np.where(started, 0.0, self._world.rewards())
        everybody = np.ones(self.num_envs, np.bool_)
        return self._world.observations(), rewards, ~everybody, self._ended.copy(), self._info(everybody)

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture of each body, where `render_mode` is "rgb_array"."""
        return self._world.pictures() if self.render_mode == "rgb_array" else None

    def close_extras(self, **kwargs: Any) -> None:
        """Release the camera, which is all that is held."""
        self._world.close()

    def _info(self, told: Bool[np.ndarray, " body"]) -> dict[str, Any]:
        """Gymnasium's convention: beside every entry, a mask of the bodies that have it; elsewhere 0 or None."""
        info: dict[str, Any] = {}
        for name, values in self._world.info().items():
            nothing: Any = None if values.dtype == object else 0
            info[name] = np.where(told.reshape(-1, *[1] * (values.ndim - 1)), values, nothing)
            info[f"_{name}"] = told.copy()
        return info


def _what_to_reset(options: Any, bodies: int, families: FamilySet) -> tuple[Bool[np.ndarray, " body"], Task | None]:
    """Which bodies the options are about, and the task that they ask for; RebodyError where they are malformed."""
    if not isinstance(options, Mapping) or "reset_mask" not in options:
        return np.ones(bodies, np.bool_), task_of_options(options, families)
    mask = options["reset_mask"]
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (bodies,) or not mask.any():
        raise RebodyError(f"reset_mask must be a boolean array of shape ({bodies},) with a True in it, not {mask!r}.")
    others = {name: value for name, value in options.items() if name != "reset_mask"}
    return mask.copy(), task_of_options(others, families)
