"""Bodies, each with a task that its observation does not show: what single and vector environments share."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, cast, get_args

import jax
import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from rebody import inputs
from rebody.bodies import Simulation
from rebody.bodies.camera import Camera
from rebody.errors import RebodyError, unknown
from rebody.jax_settings import own_jax_settings
from rebody.tasks import BaseTask, RewardForm, TaskDistribution, family_index, family_names, reward
from rebody.types import GLOBAL_FIELDS, AnyArray, GlobalState, Task

DEFAULT_BASE_TASKS = (
    BaseTask("goal", 0.5, 10.0),
    BaseTask("goal", -10.0, -0.5),
    BaseTask("velocity", 1.0, 3.0),
    BaseTask("velocity", -3.0, -1.0),
)
"""Goals [m] and velocities [m/s], forward and backward."""


class World:
    """The bodies and tasks of one environment."""

    def __init__(self, bodies: Simulation, base_tasks: Sequence[BaseTask], reward_form: str):
        """RebodyError where there is no base task, an unknown family or an unknown form of the reward."""
        if not base_tasks:
            raise RebodyError("base_tasks is empty; give at least one BaseTask(family, low, high).")
        self.bodies = bodies
        self._tasks = TaskDistribution(tuple(base_tasks))
        self._families = np.full(bodies.size, self._tasks.families[0], np.int32)
        self._targets = np.zeros(bodies.size)
        self._form = _form(reward_form)
        self._begun = np.zeros(bodies.size, np.bool_)
        self._camera: Camera | None = None

    def __getstate__(self) -> dict[str, Any]:
        # a copy opens a camera of its own
        return vars(self) | {"_camera": None}

    @property
    def observation_space(self) -> spaces.Box:
        """qpos with x, then qvel, of one body."""
        return spaces.Box(-np.inf, np.inf, self.bodies.observation().shape[1:], np.float64)

    @property
    def action_space(self) -> spaces.Box:
        """The action of one body."""
        return spaces.Box(-1.0, 1.0, (self.bodies.actions,), np.float32)

    def reset(self, body: int, rng: np.random.Generator, task: Task | None = None) -> None:
        """Put one body at its start and give it that task, else a drawn one."""
        task = self._tasks.draw(rng) if task is None else task
        self._families[body], self._targets[body] = task.family, task.target
        self.bodies.reset(rng, np.arange(self.bodies.size) == body)
        self._begun[body] = True

    def step(self, actions: Float[np.ndarray, "body action"]) -> None:
        """One step of every body; RebodyError before each has been reset."""
        if not self._begun.all():
            raise RebodyError("there is no episode yet: call reset before step.")
        self.bodies.step(actions)

    def observations(self) -> Float[np.ndarray, "body observation"]:
        """qpos with x, then qvel."""
        return self.bodies.observation()

    @own_jax_settings()
    def rewards(self) -> Float[np.ndarray, " body"]:
        """The tasks' rewards of the last step."""
        task = Task(self._families, self._targets)
        return np.asarray(_reward(task, self.bodies.observe(), self._form), np.float64)

    def info(self) -> dict[str, np.ndarray]:
        """Each body's task, which agents are not told, and its global state; arrays over bodies."""
        names = np.array(family_names(), dtype=object)
        state = self.bodies.observe()
        values = {field: getattr(state, field).astype(np.float64) for field in GLOBAL_FIELDS}
        return {"family": names[self._families], "target": self._targets.copy()} | values

    def pictures(self) -> tuple[np.ndarray, ...]:
        """Every body, each [height, width, 3] of uint8."""
        self._camera = self._camera or Camera(self.bodies.model, root=self.bodies.root)
        return tuple(self._camera.picture(qpos) for qpos in self.bodies.picture_pose())

    def close(self) -> None:
        """Release the camera; `pictures` opens another."""
        if self._camera:
            self._camera.close()
        self._camera = None


@partial(jax.jit, static_argnames="form")
def _reward(task: Task, state: GlobalState, form: RewardForm) -> Float[AnyArray, " body"]:
    return reward(task, state, form)


def task_of_options(options: Any) -> Task | None:
    """The task that `reset(options=...)` asks for, None where it asks for none.

    RebodyError where it is not a family and a target.
    """
    if options is None:
        return None
    if not isinstance(options, Mapping):
        raise RebodyError(
            f'reset options are {options!r}; give a mapping such as {{"family": "goal", "target": -3.0}}.'
        )
    if not options:
        return None
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
        raise unknown("reward", name, known)
    return cast(RewardForm, name)
