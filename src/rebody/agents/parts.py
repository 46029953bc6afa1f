"""From artifacts to parts, and from parts to an agent."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from rebody.agents.agent import Agent, IdleAgent, OracleAgent, ReuseAgent
from rebody.bodies.toys import MassDamper, Toy
from rebody.control.high_level import HighLevelPolicy
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import SLOTS, Tracker
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig, InferenceModule
from rebody.inference.contract import Contract
from rebody.inference.probe import Probe
from rebody.store import Artifact, arrays_into_tree, load_artifact
from rebody.types import Task, Tree

HORIZON = 15
"""Decisions that `reuse` looks ahead; 1 is the thesis."""


class InferenceParts(eqx.Module):
    """What an inference artifact holds: the frozen module, the toy's policy, and the probe."""

    module: InferenceModule
    high_level: HighLevelPolicy
    probe: Probe


@dataclass(frozen=True)
class Inference:
    """A loaded inference artifact."""

    name: str
    contract: Contract
    parts: InferenceParts
    toy: Toy


@dataclass(frozen=True)
class LoadedTracker:
    """A loaded tracker artifact."""

    name: str
    robot: str
    tracker: Tracker


def inference_template(config: dict[str, Any]) -> InferenceParts:
    """Parts of the right shapes, to be filled with weights."""
    inference, policy = config["inference"], config["high_level"]
    settings = InferenceConfig(**{name: _as_tuple(value) for name, value in inference.items()})
    key = jax.random.key(0)
    observations = len(policy["fields"]) + 2 * settings.latent
    families = len(config["contract"]["target_ranges"])
    weights = np.zeros((settings.latent + 1, families), np.float32)
    return InferenceParts(
        module=InferenceModule(settings, 1, key),
        high_level=HighLevelPolicy(
            _actor_template(observations, 1, policy), tuple(policy["fields"]), tuple(policy["scales"])
        ),
        probe=Probe(np.zeros(families, np.int32), weights, weights),
    )


def tracker_template(config: dict[str, Any]) -> Tracker:
    """A tracker of the right shapes, to be filled with weights."""
    actor = _actor_template(config["observations"], config["actions"], config)
    return Tracker(actor, config["max_distance"], config["max_speed"])


def load_inference(reference: str) -> Inference:
    """A shipped inference artifact by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "inference")
    with _understood(artifact):
        contract = Contract.from_config(artifact.config["contract"])
        parts = _fill(inference_template, artifact)
        return Inference(artifact.name, contract, parts, MassDamper(**artifact.config["toy"]))


def load_tracker(reference: str) -> LoadedTracker:
    """A shipped tracker artifact by name, or one in a folder; RebodyError if it cannot be read."""
    artifact = load_artifact(reference, "tracker")
    with _understood(artifact):
        return LoadedTracker(artifact.name, artifact.config["robot"], _fill(tracker_template, artifact))


def _fill(template: Callable[[dict[str, Any]], Tree], artifact: Artifact) -> Tree:
    """The template of an artifact's configuration with its weights; no random weights are drawn for it."""
    shapes = eqx.filter_eval_shape(lambda: template(artifact.config))
    zeros = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
    return arrays_into_tree(zeros, artifact.arrays, f"artifact {artifact.name}")


@contextmanager
def _understood(artifact: Artifact) -> Iterator[None]:
    """Turns what an unfamiliar config.json brings about into a message."""
    try:
        yield
    except (KeyError, TypeError) as error:
        raise RebodyError(
            f"the settings of artifact '{artifact.name}' are not understood ({error}): another release of rebody "
            "made it. Install that release, or train the artifact again."
        ) from error


def check_fit(inference: Inference, robot: str, moving_fields: tuple[str, ...]) -> None:
    """RebodyError if this module cannot work on this robot."""
    inference.contract.check_body(robot, moving_fields, SLOTS)


def build_agent(
    kind: str, inference: Inference, tasks: Task | None = None, *, stride: int = 1, horizon: int = HORIZON
) -> Agent:
    """An agent of a named kind; `oracle` needs the tasks, the active ones [time, episode]."""
    encoder = inference.parts.module.encoder
    match kind:
        case "reuse":
            return ReuseAgent(
                encoder=encoder,
                stride=stride,
                high_level=inference.parts.high_level,
                toy=inference.toy,
                family=_only_family(inference),
                horizon=horizon,
            )
        case "oracle" if tasks is not None:
            family, target = jnp.asarray(tasks.family), jnp.asarray(tasks.target)
            return OracleAgent(encoder=encoder, stride=stride, tasks=Task(family, target))
        case "idle":
            return IdleAgent(encoder=encoder, stride=stride)
    raise RebodyError(f"unknown agent '{kind}'. Agents are: reuse, oracle, idle.")


def _only_family(inference: Inference) -> int:
    family, *others = inference.contract.families
    if others:
        raise RebodyError(
            f"'{inference.name}' tells several families apart; `reuse` can drive modules of one family so far."
        )
    return family


def _actor_template(observations: int, actions: int, config: dict[str, Any]) -> Actor:
    sizes = SACConfig(hidden=tuple(config["hidden"]), projections=config["projections"])
    return Actor(observations, actions, sizes, jax.random.key(0))


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
