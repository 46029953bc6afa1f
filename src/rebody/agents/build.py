"""From parts to an agent."""

import jax.numpy as jnp

from rebody.agents.agent import Agent, FlatAgent, IdleAgent, OracleAgent, ReadoutAgent, ReuseAgent
from rebody.agents.parts import Inference
from rebody.control.tracker import SLOTS
from rebody.errors import RebodyError
from rebody.inference.exact import exact_posterior, read_mode
from rebody.types import Task

HORIZON = 15
"""Decisions that `reuse` looks ahead; 1 is the thesis."""
AGENTS = {
    "reuse": "the frozen module and the frozen policy of the toy",
    "readout": "the target read linearly from the module's belief, handed to the tracker",
    "bayes": "the exact posterior in place of the module, its most probable target handed to the tracker",
    "oracle": "told the task",
    "flat": "the frozen module, and a policy without hierarchy that was learned on the robot",
    "idle": "knows nothing and stands still",
}
"""Every kind of agent, and what it is."""


def check_agent(kind: str) -> None:
    """RebodyError if there is no agent of that kind."""
    if kind not in AGENTS:
        raise RebodyError(f"unknown agent '{kind}'. Agents are: {', '.join(AGENTS)}.")


def check_fit(kind: str, inference: Inference, robot: str, moving_fields: tuple[str, ...]) -> None:
    """RebodyError if this module cannot work on this robot."""
    inference.contract.check_body(robot, moving_fields, SLOTS)
    if kind == "reuse" and len(inference.contract.families) > 1:
        raise RebodyError(
            f"'{inference.name}' tells several families apart; on a robot `reuse` can drive modules of one family so "
            "far. On a point mass it can, and `readout` can on both."
        )


def build_agent(
    kind: str, inference: Inference, tasks: Task | None = None, *, stride: int = 1, horizon: int = HORIZON
) -> Agent:
    """An agent of a named kind; `oracle` needs the tasks, the active ones [time, episode].

    RebodyError if there is no such kind, or the module cannot serve it.
    """
    check_agent(kind)
    parts, contract = inference.parts, inference.contract
    listens = {"inferrer": parts.module.encoder, "reader": parts.probe, "stride": stride}
    told = {"told_policy": parts.told_policy, "task_code": inference.task_code}
    match kind:
        case "reuse":
            imagines = {"high_level": parts.high_level, "toy": inference.toy, "horizon": horizon}
            return ReuseAgent(**listens, **imagines, family=contract.families[0])
        case "readout":
            return ReadoutAgent(**listens, **told)
        case "bayes":
            posterior = exact_posterior(contract.target_ranges, contract.reward)
            return ReadoutAgent(inferrer=posterior, reader=read_mode, stride=stride, **told)
        case "oracle":
            assert tasks is not None
            active = Task(jnp.asarray(tasks.family), jnp.asarray(tasks.target))
            return OracleAgent(**listens, **told, tasks=active)
        case "flat":
            return FlatAgent(**listens)
        case _:
            return IdleAgent(**listens, actions=inference.toy.actions)
