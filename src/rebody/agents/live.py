"""An agent for one robot, driven from outside: observation and reward in, joint action out."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.agents.agent import Observation
from rebody.agents.build import HORIZON, build_agent, check_robot_of, slot_chooser
from rebody.agents.clock import begin, decide
from rebody.agents.controller import TrackerController
from rebody.agents.parts import Inference, LoadedSlots, LoadedTracker, load_inference, load_slots_of, load_tracker
from rebody.agents.rollout import joint_action
from rebody.bodies import RobotSpec, load_robot
from rebody.errors import RebodyError
from rebody.tasks import FAMILIES
from rebody.types import Belief, Subgoal


class LiveAgent:
    """`reuse` on one robot, step by step; see `load_agent`."""

    def __init__(
        self,
        spec: RobotSpec,
        inference: Inference,
        tracker: LoadedTracker,
        slots: LoadedSlots | None = None,
        horizon: int = HORIZON,
    ):
        """RebodyError if the module or the tracker does not fit the robot."""
        check_robot_of(tracker, spec)
        inference.contract.check_body(spec.name, spec.moving_fields, tracker.tracker.slots)
        self._spec, self._inference = spec, inference
        self._controller = TrackerController(tracker.tracker, spec.goal_ahead)
        self._agent = build_agent(
            "reuse", inference, slots=slot_chooser(inference, slots, "classifier"), horizon=horizon
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything: a new episode begins with the next step."""
        self._steps, self._pace = 0, np.zeros(())

    def step(self, observation: Float[np.ndarray, " observation"], reward: float) -> Float[np.ndarray, " action"]:
        """Joint action in [-1, 1] for one control step.

        `observation` is qpos with x, then qvel; `reward` is the task's, of the step that led here (ignored at
        the first). Every 0.1 s the agent takes in a transition and decides anew.
        """
        model = self._spec.model
        if np.shape(observation) != (model.nq + model.nv,):
            raise RebodyError(
                f"'{self._spec.name}' observes {model.nq + model.nv} numbers (qpos with x, then qvel), "
                f"got shape {np.shape(observation)}."
            )
        qpos, qvel = np.split(np.asarray(observation, float), [model.nq])
        x = np.asarray(qpos[self._spec.root_addresses[0]])
        if self._steps:
            self._pace = self._spec.next_pace(self._pace, np.asarray(x - self._last_x))
        if self._steps % self._spec.steps_per_decision == 0:
            self._decide(qpos, reward)
        self._steps, self._last_x = self._steps + 1, x
        pitch, joints = self._spec.pitch(qpos), self._spec.tracker_state(qpos, qvel, self._pace)
        x, pitch = np.asarray(x, np.float32), np.asarray(pitch, np.float32)
        return np.asarray(joint_action(self._controller, joints, x, pitch, self._command.subgoal, self._carry.belief))

    @property
    def belief(self) -> Belief:
        """Mean and variance of the latent; shapes [latent]."""
        return jax.tree.map(np.asarray, self._carry.belief)

    @property
    def inferred(self) -> tuple[str, float]:
        """Family and target [m, m/s] that a linear probe reads from the belief; the agent does not use it."""
        family, target = self._inference.parts.probe(self._carry.belief)
        return FAMILIES[int(family)].name, float(target)

    @property
    def subgoal(self) -> Subgoal:
        """What the tracker is after: a goal is a point in the world."""
        return jax.tree.map(np.asarray, self._command.subgoal)

    def _decide(self, qpos: Float[np.ndarray, " nq"], reward: float) -> None:
        if self._steps == 0:
            self._carry, self._command = begin(self._agent, self._spec.observe(qpos, qpos))
        else:
            state = self._spec.observe(qpos, self._previous_qpos)
            observation = Observation(state, jnp.asarray(reward, jnp.float32))
            self._carry, self._command = decide(self._agent, self._carry, observation)
        self._previous_qpos = qpos


def load_agent(
    robot: str = "cheetah",
    inference: str = "goal-velocity",
    tracker: str | None = None,
    classifier: str | None = None,
    horizon: int = HORIZON,
) -> LiveAgent:
    """An agent of shipped or own artifacts, ready to `step`; RebodyError if they do not fit together.

    `robot` is a name or the path of a TOML file; tracker and classifier default to `tracker-ROBOT` and
    `classifier-INFERENCE`, which a module of one family does not need.
    """
    spec, module = load_robot(robot), load_inference(inference)
    slots = load_slots_of(module, classifier)
    return LiveAgent(spec, module, load_tracker(tracker or f"tracker-{spec.name}"), slots, horizon)
