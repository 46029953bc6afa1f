"""What the live page shows: a body, its agent and its hidden task, simulated a step at a time."""

from collections import deque
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Float

from rebody.agents.agent import Observation
from rebody.agents.belief import Reading
from rebody.agents.rollout import Drive
from rebody.bodies import PointMasses, Simulation, simulate
from rebody.control.places import reachable
from rebody.evaluation.evaluate import trial_agent, trial_controller
from rebody.evaluation.trial import Trial, check_trial
from rebody.inputs import number
from rebody.ranges import Box
from rebody.tasks.task_file import TaskSpec, active_tasks
from rebody.types import DECISION_DT, POSE_FIELDS, AnyArray, GlobalState

REMEMBERED_S = 20.0
"""How far back moments are kept [s]."""
PATH_S = 600.0
"""How far back the path is kept, for a map [s]."""
FIRST_SHARE = 0.3
"""Of the largest target, where nobody says another one: it is soon reached."""


@dataclass(frozen=True)
class Moment:
    """What there is to know after a decision."""

    time_s: float
    task: TaskSpec
    """The hidden one."""
    reached: dict[str, tuple[float, ...]]
    """By family: what its targets are compared with [m, m/s, rad]."""
    reward: float
    reading: Reading
    """What the module believes. It listens beside an agent that does without it."""
    doubts: tuple[str, ...]
    """About rewards of the last 3.2 s that no task could have paid, and that the module did not believe."""
    subgoal: TaskSpec | None
    """What the agent asks of its tracker from now on; None where nobody asks (a point mass, a flat policy)."""


class Session:
    """An episode without an end, that can be meddled with."""

    def __init__(self, trial: Trial, task: TaskSpec):
        """Compiles everything, which takes seconds; RebodyError where the parts and the task do not fit together."""
        self.trial = trial
        self.moments: deque[Moment] = deque(maxlen=round(REMEMBERED_S / DECISION_DT))
        self.path: deque[tuple[float, float]] = deque(maxlen=round(PATH_S / DECISION_DT))
        """Where the body was after each decision [m]."""
        self.set_task(task)
        self.body: Simulation
        if trial.robot is None:
            self.body, self._controller = PointMasses(trial.inference.toy, 1), None
        else:
            self.body, self._controller = simulate(trial.robot, 1, threads=1), trial_controller(trial)
        self.restart()
        for _ in range(self.body.steps_per_decision):
            self.step()
        self.restart()

    def restart(self, seed: int = 0) -> None:
        """Back to the start; the agent forgets everything, the task stays."""
        self.body.reset(np.random.default_rng(seed))
        self._now = self._before = self._seen()
        self._drive = Drive(self._agent, self._controller, self.body, self.trial.in_play)
        self._listener = self.trial.inference.begin(_fields(self.body.observe(), self.trial), self.trial.sharpens)
        self.moments.clear()
        self.path.clear()
        self.path.append(self.pose[:2])

    def step(self) -> None:
        """One step of the body, which takes `body.step_s`; every 0.1 s a decision follows."""
        self._drive.agent = self._agent
        heard = self._drive.step(jax.tree.map(lambda field: field[0], self._tasks))
        self._before, self._now = self._now, self._seen()
        if heard is not None:
            self._remember(heard)

    @property
    def x(self) -> float:
        """Where the body is along x [m]."""
        return self.pose[0]

    @property
    def pose(self) -> tuple[float, float, float]:
        """Where the body is along x and y [m], and its heading [rad]."""
        return self._pose

    @property
    def is_in_plane(self) -> bool:
        """Whether body and module know of places beside the line."""
        return "y" in self.trial.inference.contract.fields

    def between(self, share: float) -> tuple[Float[np.ndarray, " nq"], Float[np.ndarray, " 2"]]:
        """Joint positions for a picture, and x and y [m], that share of the way from the step before to the last."""
        (before, there), (now, here) = self._before, self._now
        return before + share * (now - before), there + share * (here - there)

    @property
    def time_s(self) -> float:
        """Simulated seconds since the start."""
        return self._drive.steps * self.body.step_s

    def set_task(self, task: TaskSpec) -> None:
        """Another hidden task from now on; only the oracle is told. RebodyError if the module cannot infer it
        or its target is no number; the task before then stays.
        """
        for each in task.target:
            number(each, "the target")
        check_trial(self.trial, [task])
        tasks = active_tasks([task], self.trial.in_play, 1, DECISION_DT)
        self._agent = trial_agent(self.trial, tasks)
        self.task, self._tasks = task, tasks

    def push(self, change: float, axis: int = 0) -> None:
        """Change the velocity of the body's centre of mass along x, or y (axis 1) where it can move so [m/s];
        RebodyError if that is no number.
        """
        along = number(change, "the push") * np.eye(2)[[axis]]
        self.body.push(along if self.is_in_plane else along[:, 0])

    def _seen(self) -> tuple[Float[np.ndarray, " nq"], Float[np.ndarray, " 2"]]:
        """Joint positions for a picture, and x and y [m]."""
        x, y, yaw = self.body.pose()[0, [0, 1, POSE_FIELDS.index("yaw")]].tolist()
        self._pose = (x, y, yaw)
        return self.body.picture_pose()[0], np.array([x, y])

    def _remember(self, heard: Observation) -> None:
        reading = self._listener.update(_fields(heard.state, self.trial), heard.reward[0])
        said = float(heard.reward[0]), reading, self._listener.doubts()
        self.path.append(self.pose[:2])
        reached = {family.name: _numbers(family.quantity.read(heard.state)) for family in self.trial.in_play}
        self.moments.append(Moment(self.time_s, self.task, reached, *said, self._subgoal()))

    def _subgoal(self) -> TaskSpec | None:
        subgoal = self._drive.command.subgoal
        if self.trial.robot is None or not np.isfinite(subgoal.value).all():
            return None
        family = self.trial.in_play[subgoal.slot[0]]
        return TaskSpec(family.name, _numbers(subgoal.value)[: family.size])


def target_range(trial: Trial, family: str) -> Box:
    """Smallest and largest target that the module has learned and the robot is able to reach [m, m/s, rad]."""
    reach = trial.tracker.tracker.families.ranges if trial.tracker else {}
    return reachable(trial.inference.contract.families.named(family), reach.get(family))


def fitting(trial: Trial, task: TaskSpec) -> TaskSpec:
    """That task, or the nearest that the module and the robot can be given."""
    known = trial.inference.contract.families
    family = task.family if task.family in known else known.names[0]
    box = target_range(trial, family)
    target = task.target if len(task.target) == box.size and family == task.family else FIRST_SHARE * np.array(box.high)
    return TaskSpec(family, tuple(np.clip(target, box.low, box.high).tolist()))


def _fields(state: GlobalState, trial: Trial) -> dict[str, float]:
    """What the module sees."""
    return {field: float(getattr(state, field)[0]) for field in trial.inference.contract.fields}


def _numbers(vectors: AnyArray) -> tuple[float, ...]:
    """The only one of vectors [1, size]."""
    return tuple(np.asarray(vectors[0]).tolist())
