"""Bodies, each with a task that its observation does not show: what single and vector environments share."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, cast, get_args

import jax
import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from rebody import inputs
from rebody.bodies.camera import Camera
from rebody.envs.bodies import Bodies
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.tasks import BaseTask, RewardForm, TaskDistribution, family_index, family_names, reward
from rebody.types import GLOBAL_FIELDS, Task

DEFAULT_BASE_TASKS = (
    BaseTask("goal", 0.5, 10.0),
    BaseTask("goal", -10.0, -0.5),
    BaseTask("velocity", 1.0, 3.0),
    BaseTask("velocity", -3.0, -1.0),
)
"""Goals [m] and velocities [m/s], forward and backward."""


class World:
    """The bodies and tasks of one environment."""

    def __init__(self, bodies: Bodies, base_tasks: Sequence[BaseTask], reward_form: str):
        """RebodyError where there is no base task, an unknown family or an unknown form of the reward."""
        if not base_tasks:
            raise RebodyError("base_tasks is empty; give at least one BaseTask(family, low, high).")
        self.bodies = bodies
        self._tasks = TaskDistribution(tuple(base_tasks))
        self._families = np.full(bodies.size, self._tasks.families[0], np.int32)
        self._targets = np.zeros(bodies.size)
        self._reward = jax.jit(partial(reward, form=_form(reward_form)))
        self._camera: Camera | None = None

    @property
    def observation_space(self) -> spaces.Box:
        """qpos with x, then qvel, of one body."""
        size = self.bodies.qpos.shape[1] + self.bodies.qvel.shape[1]
        return spaces.Box(-np.inf, np.inf, (size,), np.float64)

    @property
    def action_space(self) -> spaces.Box:
        """The action of one body."""
        return spaces.Box(-1.0, 1.0, (self.bodies.actions,), np.float32)

    def reset(self, body: int, rng: np.random.Generator, options: Mapping[str, Any] | None = None) -> None:
        """Put one body at its start and give it the task of the options, else a drawn one."""
        task = task_of_options(options) if options else self._tasks.draw(rng)
        self._families[body], self._targets[body] = task.family, task.target
        self.bodies.reset(body, rng)

    def observations(self) -> Float[np.ndarray, "body observation"]:
        """qpos with x, then qvel."""
        return np.concatenate([self.bodies.qpos, self.bodies.qvel], axis=-1)

    @own_jax_settings()
    def rewards(self) -> Float[np.ndarray, " body"]:
        """The tasks' rewards of the last step."""
        task = Task(self._families, self._targets)
        return np.asarray(self._reward(task, self.bodies.global_state()), np.float64)

    def info(self) -> dict[str, np.ndarray]:
        """Each body's task, which agents are not told, and its global state; arrays over bodies."""
        names = np.array(family_names(), dtype=object)
        state = self.bodies.global_state()
        values = {field: getattr(state, field).astype(np.float64) for field in GLOBAL_FIELDS}
        return {"family": names[self._families], "target": self._targets.copy()} | values

    def pictures(self) -> tuple[np.ndarray, ...]:
        """Every body, each [height, width, 3] of uint8."""
        self._camera = self._camera or Camera(self.bodies.model, root=self.bodies.root)
        return tuple(self._camera.picture(qpos) for qpos in self.bodies.qpos)

    def close(self) -> None:
        """Release the camera."""
        if self._camera:
            self._camera.close()


def task_of_options(options: Mapping[str, Any]) -> Task:
    """The task that `reset(options=...)` asks for; RebodyError where it is not a family and a target."""
    if options.keys() != {"family", "target"}:
        raise RebodyError(
            f"reset options are {', '.join(map(repr, options))}; give 'family' and 'target' together, "
            'as in options={"family": "goal", "target": -3.0}, or no options to have a task drawn.'
        )
    family = family_index(str(options["family"]))
    return Task(np.asarray(family), np.asarray(inputs.number(options["target"], "the target")))


def _form(name: str) -> RewardForm:
    known = get_args(RewardForm)
    if name not in known:
        raise RebodyError(f"unknown reward '{name}'; choose one of {', '.join(known)}.")
    return cast(RewardForm, name)
