"""A Gymnasium robot that is paid for a task which it is not told."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from gymnasium.envs.mujoco import MujocoEnv
from gymnasium.utils import EzPickle
from jaxtyping import Float

from rebody.errors import RebodyError, unknown
from rebody.standard.draws import Target, TaskSet

SPLITS = ("any", "train", "test")


class HiddenTask(MujocoEnv, EzPickle):
    """Goes in front of one of Gymnasium's robots: the physics and the step are theirs, reward and observation are not.

    `info` has the task, which the observation does not show, and the parts of the reward as `reward_NAME`.
    """

    tasks: ClassVar[TaskSet]
    weights: ClassVar[dict[str, Any]]
    """Settings of Gymnasium's class: what its own costs weigh."""

    def __init__(self, split: str = "any", **settings: Any):
        """`split` says where tasks are drawn from: all that there are, or those of training or of testing.

        Settings are Gymnasium's, such as `render_mode`. RebodyError for a split that there is not.
        """
        if split not in SPLITS:
            raise unknown("split", split, SPLITS)
        super().__init__(**self.weights, **settings)  # pyright: ignore[reportCallIssue]
        EzPickle.__init__(self, split, **settings)
        self.split = split
        self.task: Any = self.tasks.train[0]
        """What is paid for."""
        self.observation_space = spaces.Box(-np.inf, np.inf, self._get_obs().shape, np.float64)

    def reset(self, *, seed: Any = None, options: Any = None):
        """Start anew; `options` may name the task, {"task": 1.5}. Without, one is drawn.

        RebodyError, and nothing is reset, for other options or a task that is none.
        """
        asked = self._asked(options)
        observation, info = super().reset(seed=seed)
        self.task = self.draw() if asked is None else asked
        return observation, info | {"task": self.task}

    def draw(self) -> Target:
        """A task of the split."""
        if self.split == "any":
            return self.tasks.draw(self.np_random)
        among = self.tasks.train if self.split == "train" else self.tasks.test
        return among[self.np_random.integers(len(among))]

    @abstractmethod
    def reward_parts(self, x_velocity: float, action: Float[np.ndarray, " action"]) -> dict[str, float]:
        """What the reward of the step just taken is the sum of, by name; `x_velocity` is the displacement over that
        step divided by its time [m/s].
        """

    @abstractmethod
    def _get_obs(self) -> Float[np.ndarray, " observation"]: ...

    def _get_rew(self, x_velocity: float, action: Float[np.ndarray, " action"]) -> tuple[float, dict[str, Any]]:
        # called by Gymnasium's step, which adds the second to `info`
        parts = self.reward_parts(x_velocity, action)
        named = {f"reward_{name}": float(part) for name, part in parts.items()}
        return float(sum(parts.values())), named | {"task": self.task}

    def _asked(self, options: Any) -> Target | None:
        if not options:
            return None
        if not isinstance(options, Mapping) or options.keys() != {"task"}:
            raise RebodyError(f'reset options are {options!r}; give {{"task": ...}}, or none to have a task drawn.')
        return self.tasks.admit(options["task"])
