"""A walking policy that was learned here: what its artifact says, and its network, in NumPy."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from rebody.bodies.walking.joystick import WAYS, Joystick
from rebody.bodies.walking.metadata import TERMS
from rebody.bodies.walking.settings import Term
from rebody.errors import RebodyError
from rebody.ranges import Box, Layers, Positive
from rebody.store import load_artifact, shipped_artifacts
from rebody.store.artifact import MANIFEST, Artifact
from rebody.store.typed import Misfit, typed

KIND = "walking"
"""Of its artifact."""
Three = tuple[float, float, float]
Memory = dict[str, Float[np.ndarray, "robot ..."]]


@dataclass(frozen=True)
class WalkingSettings:
    """All that a robot needs in order to walk by it."""

    robot: str
    control_dt: Positive
    """Seconds of a control step."""
    inputs: tuple[Term, ...]
    """What it hears, in order, as it is: scales are in its weights."""
    joints: tuple[str, ...]
    """In the order of observations and actions."""
    rest: tuple[float, ...]
    """Position of each joint at an action of 0 [rad]."""
    action_scale: tuple[float, ...]
    """Of each joint: radians of an action of 1."""
    stiffness: tuple[float, ...]
    """PD gains of each joint's servo [N m/rad]; none where it has other actuators."""
    damping: tuple[float, ...]
    """[N m s/rad]"""
    low: Three
    """Slowest commands that it was trained for [m/s, m/s, rad/s]."""
    high: Three
    """Fastest ones."""
    dead: Three
    """Slowest command of each way that moves it, measured."""
    drift: Three
    """How it moves while none is given, measured."""
    hidden: Layers
    at_once: Positive = Joystick.at_once
    """How many ways it follows at full at once, measured."""
    rate: Positive | None = None
    """How fast the stick may move, measured [1/s]; None where it may jump."""
    training: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        """ValueError for numbers that do not belong to its joints."""
        for name in ("rest", "action_scale"):
            if len(getattr(self, name)) != len(self.joints):
                raise ValueError(f"{name}: {len(self.joints)} numbers are needed, one for each joint")
        if unknown := [term for term in self.inputs if term not in TERMS.values()]:
            raise ValueError(f"inputs: a policy that was learned here does not hear {unknown[0]}")
        if not 1 <= self.at_once <= len(WAYS):
            raise ValueError(f"at_once: it must be from 1 to {len(WAYS)}")

    @property
    def joystick(self) -> Joystick:
        """What it follows, as it was measured."""
        rate = math.inf if self.rate is None else self.rate
        return Joystick(Box(self.low, self.high), self.dead, self.drift, self.at_once, rate)

    @property
    def observations(self) -> int:
        """Numbers that it hears."""
        of_joints = ("joint_positions", "joint_velocities", "last_action")
        return sum(len(self.joints) if term in of_joints else len(WAYS) for term in self.inputs)

    @property
    def metadata(self) -> dict[str, str]:
        """The same in the words of mjlab's ONNX files."""
        words = {term: word for word, term in reversed(TERMS.items())}
        lists = {
            "observation_names": [words[term] for term in self.inputs],
            "joint_names": self.joints,
            "default_joint_pos": self.rest,
            "action_scale": self.action_scale,
            "joint_stiffness": self.stiffness,
            "joint_damping": self.damping,
        }
        return {name: ",".join(map(str, values)) for name, values in lists.items() if values}


@dataclass(frozen=True)
class TrainedPolicy:
    """The network of such an artifact, called as `OnnxPolicy` is."""

    reference: str
    """The artifact: a shipped name, or a folder."""

    @cached_property
    def settings(self) -> WalkingSettings:
        """What it was trained for; RebodyError where the artifact cannot be read."""
        try:
            return typed(self._artifact.config, WalkingSettings)
        except Misfit as misfit:
            raise self._refused(str(misfit)) from misfit

    @property
    def is_there(self) -> bool:
        """Whether an artifact has been made; it may be damaged."""
        return self.reference in dict(shipped_artifacts()) or (Path(self.reference) / MANIFEST).exists()

    @property
    def metadata(self) -> dict[str, str]:
        """In mjlab's words."""
        return self.settings.metadata

    @property
    def observations(self) -> int:
        """Numbers in an observation."""
        return self.settings.observations

    @property
    def actions(self) -> int:
        """Numbers in an action."""
        return len(self.settings.joints)

    def initial(self, robots: int) -> Memory:
        """It remembers nothing."""
        return {}

    @cached_property
    def layers(self) -> list[tuple[Float[np.ndarray, "inputs outputs"], Float[np.ndarray, " outputs"]]]:
        """Weights and biases from the first layer to the last; RebodyError where their sizes are others."""
        sizes = [self.observations, *self.settings.hidden, 2 * self.actions]
        layers = []
        for i, shape in enumerate(pairwise(sizes)):
            weight, bias = (self._artifact.arrays.get(f"{part}.{i}") for part in ("weights", "biases"))
            if weight is None or bias is None or weight.shape != shape or bias.shape != shape[1:]:
                raise self._refused(f"its layer {i + 1} is not {shape[0]} x {shape[1]} numbers")
            layers.append((weight, bias))
        return layers

    def __call__(
        self, observation: Float[np.ndarray, "robot number"], memory: Memory
    ) -> tuple[Float[np.ndarray, "robot action"], Memory]:
        """Its most likely actions, in [-1, 1]: the first half of its outputs; the rest says how it explored."""
        *hidden, (weight, bias) = self.layers
        x = observation
        for inner, offset in hidden:
            x = _silu(x @ inner + offset)
        return np.tanh(x @ weight[:, : self.actions] + bias[: self.actions]), memory

    @cached_property
    def _artifact(self) -> Artifact:
        return load_artifact(self.reference, KIND)

    def _refused(self, why: str) -> RebodyError:
        return RebodyError(f"the walking policy '{self.reference}' is not understood ({why}). Train it anew.")


def _silu(x: Float[np.ndarray, "robot unit"]) -> Float[np.ndarray, "robot unit"]:
    return x * (0.5 + 0.5 * np.tanh(0.5 * x))  # x times the logistic function, which overflows nowhere
