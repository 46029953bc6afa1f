"""What a tracker learns, as a plain Gymnasium environment: for other learners, and to compare them with ours."""

from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any

import gymnasium
import jax
import numpy as np
from gymnasium import spaces

from rebody import inputs
from rebody.bodies import RobotBatch, load_robot
from rebody.control.command import Command, after
from rebody.control.tracker import tracker_observation, tracker_reward
from rebody.envs.seeds import body_seed
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.training.motion import motion_of, no_command
from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.orders import draw_commands
from rebody.training.tracker.presets import tracker_preset
from rebody.training.tracker.schedule import segment_steps
from rebody.types import AnyArray


class TrackerEnv(gymnasium.Env):
    """One robot that is told what to do: its command is part of the observation, and changes now and then.

    Observation and reward are those that `rebody train tracker` learns from; an episode ends with a fall.
    """

    def __init__(self, robot: str = "cheetah", config: TrackerConfig | None = None):
        """Commands, their duration and the reward are those of the robot's preset unless given."""
        self._spec = load_robot(robot)
        self._config = config or tracker_preset(self._spec)
        self._batch = RobotBatch(self._spec, 1, threads=1)
        self._command: Command | None = None
        self.action_space = spaces.Box(-1.0, 1.0, (self._spec.model.nu,), np.float32)

    @cached_property
    @own_jax_settings()
    def observation_space(self) -> spaces.Box:
        """Joint state, then the command."""
        nothing = no_command(1, self._config.families)
        # the shape alone: a process in which JAX has computed cannot be forked any more
        seen = jax.eval_shape(lambda told: _observation(self._batch.proprioception(), told, self._config), nothing)
        return spaces.Box(-np.inf, np.inf, seen.shape[1:], np.float32)

    @own_jax_settings()
    def reset(self, *, seed: Any = None, options: Any = None):
        """The rest pose, and a new command. RebodyError, and nothing is reset, for options or a seed that is none."""
        if options is not None and (not isinstance(options, Mapping) or options):
            raise RebodyError(f"reset options are {options!r}; this environment has none.")
        super().reset(seed=body_seed(seed))
        self._batch.reset(self.np_random)
        self._command = self._new_command()
        return self._observe(self._command), {}

    @own_jax_settings()
    def step(self, action: Any):
        """One control step with an action in [-1, 1]; larger ones are clipped.

        RebodyError, and nothing moves, for NaN or another shape, and before the first reset.
        """
        told, config = self._command, self._config
        if told is None:
            raise RebodyError("there is no episode yet: call reset before step.")
        action = inputs.numbers(action, (self._spec.model.nu,), "the action")
        before = self._batch.pose()
        self._batch.step(action[None])
        motion = motion_of(self._batch, before)
        reward = _reward(told, motion, action.astype(np.float32)[None], self._spec.control_dt, config)
        command: Command = jax.tree.map(np.asarray, after(config.families, told, motion))
        self._steps_left -= 1
        self._command = command = self._new_command() if self._steps_left < 0 else command
        return self._observe(command), float(reward[0]), bool(motion.fell[0]), False, {}

    def _new_command(self) -> Command:
        key = jax.random.key(self.np_random.integers(2**32, dtype=np.uint32))
        pose = self._batch.pose().astype(np.float32)
        command = jax.tree.map(np.asarray, draw_commands(key, pose, self._config))
        shortest, longest = segment_steps(self._config, self._spec.control_dt)
        self._steps_left = int(self.np_random.integers(shortest, longest + 1))
        return command

    def _observe(self, command: Command) -> np.ndarray:
        joints = self._batch.proprioception()
        return np.asarray(_observation(joints, command, self._config))[0]


@partial(jax.jit, static_argnames="config")
def _observation(joints: AnyArray, command: Command, config: TrackerConfig) -> AnyArray:
    return tracker_observation(joints, command, config.families)


@partial(jax.jit, static_argnames=("control_dt", "config"))
def _reward(command: Command, motion, action: AnyArray, control_dt: float, config: TrackerConfig) -> AnyArray:
    return tracker_reward(command, motion, control_dt, action, config.families, config.reward)
