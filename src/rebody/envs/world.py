"""Bodies, each with a task that its observation does not show: what single and vector environments share."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import jax
import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from rebody import inputs
from rebody.bodies import Simulation
from rebody.bodies.camera import Camera
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.ranges import interval
from rebody.tasks import FamilySet
from rebody.tasks.family_set import draw
from rebody.tasks.line import GOAL, VELOCITY
from rebody.types import GLOBAL_FIELDS, AnyArray, GlobalState, Task

DEFAULT_FAMILIES = FamilySet(
    (
        GOAL.within(interval(0.5, 10.0), interval(-10.0, -0.5), law="plain"),
        VELOCITY.within(interval(1.0, 3.0), interval(-3.0, -1.0), law="plain"),
    )
)
"""Goals [m] and velocities [m/s], forward and backward, paid by -|error|."""


class World:
    """The bodies and tasks of one environment."""

    def __init__(self, bodies: Simulation, families: Any):
        """RebodyError where what is given is no set of families."""
        if not isinstance(families, FamilySet):
            raise RebodyError(f"families is {families!r}; give a rebody.tasks.FamilySet of at least one family.")
        self.bodies = bodies
        self.families: FamilySet = families
        self._family = np.zeros(bodies.size, np.int32)
        self._target = np.zeros((bodies.size, families.size))
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
        task = draw(self.families, rng) if task is None else task
        self._family[body], self._target[body] = task.family, task.target
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
        task = Task(self._family, self._target)
        return np.asarray(_reward(self.families, task, self.bodies.observe()), np.float64)

    def info(self) -> dict[str, np.ndarray]:
        """Each body's task, which agents are not told, and its global state; arrays over bodies.

        Targets are [body, axis], with zeros behind those of a smaller family.
        """
        names = np.array(self.families.names, dtype=object)
        state = self.bodies.observe()
        values = {field: getattr(state, field).astype(np.float64) for field in GLOBAL_FIELDS}
        return {"family": names[self._family], "target": self._target.copy()} | values

    def pictures(self) -> tuple[np.ndarray, ...]:
        """Every body, each [height, width, 3] of uint8."""
        self._camera = self._camera or Camera(self.bodies.model, root=self.bodies.root)
        return tuple(self._camera.picture(qpos) for qpos in self.bodies.picture_pose())

    def close(self) -> None:
        """Release the camera; `pictures` opens another."""
        if self._camera:
            self._camera.close()
        self._camera = None


@partial(jax.jit, static_argnames="families")
def _reward(families: FamilySet, task: Task, state: GlobalState) -> Float[AnyArray, " body"]:
    return families.reward(task, state)


def task_of_options(options: Any, families: FamilySet) -> Task | None:
    """The task that `reset(options=...)` asks for, None where it asks for none.

    RebodyError where it is not one of the families and a target, a number or as many as the family has.
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
    target = options["target"]
    numbers = target if isinstance(target, list | tuple | np.ndarray) and np.ndim(target) == 1 else [target]
    return families.task(str(options["family"]), [inputs.number(number, "the target") for number in numbers])
