"""What a flat policy reaches on hidden tasks, and the artifact that it leaves behind."""

from pathlib import Path

from rebody.agents.build import build_agent
from rebody.agents.configs import FlatSettings
from rebody.agents.controller import FlatController
from rebody.agents.parts import Inference
from rebody.bodies import RobotSpec
from rebody.control.flat import FlatPolicy
from rebody.store import tree_hash
from rebody.training.card import save
from rebody.training.flat.config import FlatConfig
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.run import Run
from rebody.training.task_inference import tasks_within


def measure(policy: FlatPolicy, module: Inference, spec: RobotSpec, config: FlatConfig) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    controller = FlatController(policy, module.parts.module.decoder)
    agent, tasks, form = build_agent("flat", module), tasks_within(module, spec.reach), module.contract.reward
    return figures_of(*act(agent, controller, spec, tasks, form, config.held_out, config.held_out_s))


def save_flat(
    policy: FlatPolicy, figures: dict[str, float], module: Inference, spec: RobotSpec, config: FlatConfig, run: Run
) -> Path:
    """Write artifact and card."""
    actor = policy.actor
    settings = FlatSettings(
        robot=spec.name,
        inference=module.name,
        inference_hash=tree_hash(module.parts.module),
        reach=policy.view.reach,
        places=policy.view.places,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=run.training(config),
    )
    steps = run.iterations * config.steps * config.robots
    what = (
        f"Flat policy of '{spec.name}': (joint state, x, belief of '{module.name}') -> joint action, without "
        f"subgoals. Trained on {steps:,} control steps with {run.iterations * config.updates:,} updates."
    )
    rows = rows_of(figures, config.held_out, config.held_out_s)
    return save("flat", settings, policy, run, f"Flat policy: {spec.name}", what, rows)
