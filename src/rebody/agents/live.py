"""An agent for one robot, driven from outside: observation and reward in, joint action out."""

from collections import deque
from dataclasses import dataclass
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody import inputs
from rebody.agents.agent import Carry, Observation, standing_still
from rebody.agents.build import HORIZON, build_agent, check_robot_of, slot_chooser
from rebody.agents.clock import begin, decide, pass_over
from rebody.agents.controller import TrackerController
from rebody.agents.doubts import RewardWatch
from rebody.agents.parts import (
    Inference,
    LoadedSlots,
    LoadedTracker,
    load_inference,
    load_slots_of,
    load_tracker,
    tracker_of,
)
from rebody.agents.rollout import joint_action
from rebody.agents.unknown import Explained, explained
from rebody.bodies import RobotSpec, load_robot
from rebody.bodies.walking.joystick import navigator_sees
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.types import Belief, Subgoal

ON_BAD_INPUT = ("error", "hold")
"""What becomes of numbers that cannot be: an error, or the last good ones for a while and then standing still."""
HOLD_S = 0.3
"""How long the last command is kept over bad input [s]; afterwards the tracker is told to stand still."""
STATES_OF_A_TRANSITION = 3
"""Good observations in a row, a decision apart, that a transition rests on: two states, each with its velocity."""


@dataclass(frozen=True)
class AgentStatus:
    """How it stands with an agent."""

    mode: Literal["running", "holding", "standing still"]
    """`holding`: the last command is kept, since the input is bad; `standing still`: it has been for too long, or no
    known task explains the rewards and the agent is to stand then."""
    bad_input: str | None
    """What is wrong with the newest observation or reward, if anything is."""
    doubts: tuple[str, ...]
    """About rewards of the last 3.2 s that no task could have paid; they were not believed. Of a module that hears any
    law: about rewards that no task which it knows explains."""
    notes: tuple[str, ...]
    """About rewards of the last 3.2 s that no task in the module's ranges would have paid."""
    explained: float | None = None
    """Share of the rewards' variance that the likeliest task explains, in [0, 1], of sharpened beliefs of a module that
    hears any law; None for others."""


class LiveAgent:
    """`reuse` on one robot, step by step; see `load_agent`."""

    def __init__(
        self,
        spec: RobotSpec,
        inference: Inference,
        tracker: LoadedTracker,
        slots: LoadedSlots | None = None,
        horizon: int = HORIZON,
        on_bad_input: str = "error",
        sharpen: bool = True,
        stands_when_unknown: bool = False,
    ):
        """RebodyError if the module or the tracker does not fit the robot, or `on_bad_input` is none of the two."""
        if on_bad_input not in ON_BAD_INPUT:
            raise RebodyError(f"on_bad_input is {on_bad_input!r}; choose one of {', '.join(ON_BAD_INPUT)}.")
        check_robot_of(tracker, spec)
        inference.contract.check_body(spec.name, spec.moving_fields, tracker.tracker.families.names)
        self._spec, self._inference, self._on_bad_input = spec, inference, on_bad_input
        self._stands_when_unknown = stands_when_unknown
        # the tracker's own, too: a command to stand still need not be one that the module knows
        self._families = inference.contract.families.beside(tracker.tracker.families)
        self._controller = TrackerController(tracker.tracker, self._families, spec.goal_ahead)
        chooser = slot_chooser(inference, slots, "belief" if slots is None and inference.can_sharpen else "classifier")
        self._agent = build_agent(
            "reuse", inference, families=self._families, slots=chooser, horizon=horizon, sharpen=sharpen
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything: a new episode begins with the next step."""
        self._steps, self._bad_steps, self._pace = 0, 0, np.zeros(())
        self._bad_input: str | None = None
        self._last_x: Float[np.ndarray, ""] | None = None
        self._carry: Carry | None = None
        self._watch = RewardWatch(self._inference.contract)
        self._explained: Explained | None = None
        self._trail = deque[Float[np.ndarray, " nq"]](maxlen=self._spec.steps_per_decision + 1)
        self._stick = np.zeros(self._spec.actions)

    @own_jax_settings()
    def step(self, observation: Any, reward: Any) -> Float[np.ndarray, " action"]:
        """Joint action in [-1, 1] for one control step; of a robot that walks already forward, sideways and turn, of
        which `robot.walking.joystick.command` makes m/s and rad/s.

        `observation` is qpos with x, then qvel, in one array; `reward` is the task's, of the step that led here
        (ignored at the first), None where nothing was heard. Every 0.1 s the agent takes in a transition and decides
        anew. RebodyError for numbers that are not finite, beyond `rebody.inputs.LARGEST` or of another shape; with
        `on_bad_input="hold"` only at the first step, afterwards `status` says so.
        """
        observation, heard, is_whole = self._admit(observation, reward)
        qpos, qvel = np.split(observation, [self._spec.model.nq])
        x = np.asarray(qpos[self._spec.readout.ground[0]])
        if self._last_x is not None and is_whole:
            self._pace = self._spec.next_pace(self._pace, np.asarray(x - self._last_x))
        if self._steps % self._spec.steps_per_decision == 0:
            self._decide(qpos, heard, is_whole)
        self._steps, self._last_x, self._observation = self._steps + 1, x if is_whole else None, observation
        pose, joints = self._spec.pose(qpos), self._felt(qpos, qvel)
        return self._limited(np.asarray(joint_action(self._controller, joints, pose, self._told, self._heard.belief)))

    def _limited(self, action: Float[np.ndarray, " action"]) -> Float[np.ndarray, " action"]:
        """A joystick moves no faster than the robot can take."""
        if self._spec.walking is None:
            return action
        self._stick = self._spec.walking.joystick.towards(self._stick, action, self._spec.control_dt)
        return self._stick.astype(np.float32)

    def _felt(self, qpos: Float[np.ndarray, " nq"], qvel: Float[np.ndarray, " nv"]) -> Float[np.ndarray, " joint"]:
        """What the tracker, or the navigator of a robot that walks already, sees of the body."""
        if self._spec.walking is None:
            return self._spec.tracker_state(qpos, qvel, self._pace)
        self._trail.append(qpos)
        moved = self._spec.observe(qpos, self._trail[0])
        return navigator_sees(moved, self._spec.walking.joystick.measured, np).astype(np.float32)

    @property
    def belief(self) -> Belief:
        """Mean and variance of the latent; shapes [latent]."""
        return jax.tree.map(np.asarray, self._heard.belief)

    @property
    @own_jax_settings()
    def inferred(self) -> tuple[str, tuple[float, ...]]:
        """Family and target [m, m/s, rad] that are read from the belief; the agent does not use it."""
        which, target = self._agent.reader(self._heard.belief)
        family = self._inference.contract.families[which]
        return family.name, tuple(np.asarray(target)[: family.size].tolist())

    @property
    def subgoal(self) -> Subgoal:
        """What the tracker is after: a goal is a point in the world."""
        return jax.tree.map(np.asarray, self._told)

    @property
    def status(self) -> AgentStatus:
        """Whether the input is good, and whether the rewards can be believed."""
        mode = "standing still" if self._stands_still else "holding" if self._bad_steps else "running"
        known = self._explained
        doubts = self._watch.doubts() + (known.doubts if known else ())
        return AgentStatus(mode, self._bad_input, doubts, self._watch.notes(), known and known.share)

    @property
    def _heard(self) -> Carry:
        if self._carry is None:
            raise RebodyError("the agent has not seen anything yet: call step first.")
        return self._carry

    @property
    def _told(self) -> Subgoal:
        """The subgoal that the tracker follows now."""
        if not self._stands_still:
            return self._heard.command.subgoal
        return standing_still(self._families, ())

    @property
    def _stands_still(self) -> bool:
        is_lost = self._stands_when_unknown and self._explained is not None and self._explained.is_unknown
        return is_lost or self._bad_steps > round(HOLD_S / self._spec.control_dt)

    def _admit(self, observation: Any, reward: Any) -> tuple[Float[np.ndarray, " observation"], float | None, bool]:
        """What can be used of observation and reward, and whether the observation is whole."""
        model = self._spec.model
        where = f"decision {self._steps // self._spec.steps_per_decision}"
        what, shape = f"the observation of '{self._spec.name}' (qpos with x, then qvel)", (model.nq + model.nv,)
        self._bad_input, is_whole, heard = None, True, None
        try:
            heard = inputs.reward(reward, where)
            usable = inputs.numbers(observation, shape, what, where)
        except RebodyError as error:
            if self._on_bad_input == "error" or self._carry is None:
                raise
            self._bad_input = str(error)
            bad = inputs.bad_entries(observation, shape)
            is_whole, usable = not bad.any(), self._observation.copy()
            usable[~bad] = np.asarray(observation, float)[~bad] if not bad.all() else []
            heard = heard if is_whole else None
        self._bad_steps = self._bad_steps + 1 if self._bad_input else 0
        return usable, heard, is_whole

    def _decide(self, qpos: Float[np.ndarray, " nq"], reward: float | None, is_whole: bool) -> None:
        """At a decision: a state that is not whole has no velocity, nor has the one after it."""
        if self._carry is None:
            self._carry, _ = begin(self._agent, self._spec.observe(qpos, qpos))
            self._previous_qpos, self._good_decisions = qpos, STATES_OF_A_TRANSITION
            return
        self._good_decisions = self._good_decisions + 1 if is_whole else 0
        if self._good_decisions >= STATES_OF_A_TRANSITION - 1:
            self._take_in(qpos, reward if self._good_decisions >= STATES_OF_A_TRANSITION else None)
        self._previous_qpos = qpos

    def _take_in(self, qpos: Float[np.ndarray, " nq"], reward: float | None) -> None:
        assert self._carry is not None
        state = self._spec.observe(qpos, self._previous_qpos)
        if reward is not None and self._watch.hear(self._carry.previous, state, reward):
            observation = Observation(state, jnp.asarray(reward, jnp.float32))
            self._carry, _ = decide(self._agent, self._carry, observation)
            self._explained = explained(self._agent.inferrer, self._carry.memory)
            return
        if reward is None:
            self._watch.pass_over()
        self._carry, _ = pass_over(self._agent, self._carry, state)


@own_jax_settings()
def load_agent(
    robot: str = "cheetah",
    inference: str = "goal-velocity",
    tracker: str | None = None,
    classifier: str | None = None,
    horizon: int = HORIZON,
    on_bad_input: str = "error",
    sharpen: bool = True,
    stands_when_unknown: bool = False,
) -> LiveAgent:
    """An agent of shipped or own artifacts, ready to `step`; RebodyError if they do not fit together.

    `robot` is a name or the path of a TOML file; the tracker defaults to `tracker-ROBOT`. Slots are chosen by the
    belief itself, or by a `classifier` where one is given; without `sharpen` the encoder's belief stays as it is, and
    the classifier defaults to `classifier-INFERENCE` (the thesis' way). With `on_bad_input="hold"` a sensor that drops
    out raises nothing: numbers that cannot be are replaced by the last good ones, the last command is kept for at most
    0.3 s, and then the robot is told to stand still until the input is good again; `status` says so. With
    `stands_when_unknown` it also stands still while no task that the module knows explains the rewards: of modules that
    hear any law, sharpened (docs/any-law.md).
    """
    spec, module = load_robot(robot), load_inference(inference)
    by_belief = classifier is None and sharpen and module.can_sharpen
    slots = None if by_belief else load_slots_of(module, classifier)
    tracked = load_tracker(tracker_of(spec) if tracker is None else tracker)
    return LiveAgent(spec, module, tracked, slots, horizon, on_bad_input, sharpen, stands_when_unknown)
