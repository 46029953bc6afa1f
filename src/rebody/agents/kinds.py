"""The kinds of agents: a new one is an entry here, and a line about it in `rebody.names`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp

from rebody.agents.agent import (
    Agent,
    BelievingReuseAgent,
    FlatAgent,
    IdleAgent,
    OracleAgent,
    ReadoutAgent,
    RetrainAgent,
    SharpReuseAgent,
    ToldReuseAgent,
)
from rebody.agents.parts import Inference, ScratchParts
from rebody.agents.slots import OneSlot, SlotChooser
from rebody.control.slot_policy import SlotPolicy
from rebody.inference.exact import exact_posterior, read_mode
from rebody.inference.particles import ParticlePosterior
from rebody.tasks import FamilySet
from rebody.types import Task


@dataclass(frozen=True)
class Ingredients:
    """What agents are made of; each kind takes what it needs."""

    inference: Inference
    families: FamilySet
    """What subgoals are about: those of the module, and what else is in play."""
    tasks: Task | None
    """The active ones, [time, episode]."""
    slots: SlotChooser | None
    high_level: SlotPolicy | None
    scratch: ScratchParts | None
    stride: int
    horizon: int
    sharpen: bool

    @property
    def listening(self) -> dict[str, Any]:
        """Of an agent whose belief is the frozen module's."""
        return self._believing(sharpen=False)

    @property
    def believing_sharply(self) -> dict[str, Any]:
        """Of one whose belief is sharpened, where that is wanted."""
        return self._believing(self.sharpen)

    def _believing(self, sharpen: bool) -> dict[str, Any]:
        inferrer, reader = self.inference.believing(sharpen)
        return {"inferrer": inferrer, "reader": reader, **self.speaking}

    @property
    def speaking(self) -> dict[str, Any]:
        """Of any agent."""
        return {"families": self.families, "stride": self.stride}

    @property
    def told(self) -> dict[str, Any]:
        """Of an agent that takes a task for true."""
        return {"told_policy": self.inference.parts.told_policy, "task_code": self.inference.task_code}


@dataclass(frozen=True)
class Kind:
    """One kind of agent."""

    build: Callable[[Ingredients], Agent]
    in_thesis_mode: bool = False
    """Whether its module may tick once per stride (6.3.3)."""
    sharpens: bool = False
    """Whether its beliefs may be sharpened; policies that learned on a robot have those that they learned with."""
    by_own_laws: bool = False
    """Whether it believes by the families' own laws, so that it makes no sense of another payment."""
    on_robots_alone: bool = False
    """Whether its policy learned on a robot, so that a point mass cannot have it."""


def _reuse(of: Ingredients) -> Agent:
    parts = of.inference.parts
    made_of = of.believing_sharply | {
        "toy": of.inference.toy,
        "slots": of.slots or OneSlot(),  # a point mass has no slots: the first family stands for all
        "horizon": of.horizon,
    }
    if parts.high_level is None:
        return ToldReuseAgent(**made_of, **of.told)
    by_belief = {"interpret": parts.module.decoder.interpret, "high_level": parts.high_level}
    if of.sharpen and of.inference.can_sharpen:
        return SharpReuseAgent(**made_of, **by_belief, **of.told)
    return BelievingReuseAgent(**made_of, **by_belief)


def _retrain(of: Ingredients) -> Agent:
    assert of.high_level is not None
    return RetrainAgent(**of.listening, interpret=of.inference.parts.module.decoder.interpret, policy=of.high_level)


def _readout(of: Ingredients) -> Agent:
    return ReadoutAgent(**of.believing_sharply, **of.told)


def _bayes(of: Ingredients) -> Agent:
    families = of.inference.contract.families
    posterior = exact_posterior(families) if families.size == 1 else ParticlePosterior(families)
    return ReadoutAgent(inferrer=posterior, reader=read_mode, **of.speaking, **of.told)


def _oracle(of: Ingredients) -> Agent:
    assert of.tasks is not None
    active = Task(jnp.asarray(of.tasks.family), jnp.asarray(of.tasks.target))
    return OracleAgent(**of.listening, **of.told, tasks=active)


def _flat(of: Ingredients) -> Agent:
    return FlatAgent(**of.listening)


def _scratch(of: Ingredients) -> Agent:
    assert of.scratch is not None
    return FlatAgent(inferrer=of.scratch.module.encoder, reader=of.scratch.probe, **of.speaking)


def _idle(of: Ingredients) -> Agent:
    return IdleAgent(**of.listening, actions=of.inference.toy.actions)


KINDS = {
    "reuse": Kind(_reuse, in_thesis_mode=True, sharpens=True),
    "retrain": Kind(_retrain, in_thesis_mode=True, on_robots_alone=True),
    "readout": Kind(_readout, in_thesis_mode=True, sharpens=True),
    "bayes": Kind(_bayes, in_thesis_mode=True, by_own_laws=True),
    "oracle": Kind(_oracle),
    "flat": Kind(_flat, on_robots_alone=True),
    "scratch": Kind(_scratch, on_robots_alone=True),
    "idle": Kind(_idle),
}
"""By name; `rebody.names.AGENTS` says what each is."""
