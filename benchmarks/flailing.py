"""What a robot that cannot do anything yet reveals of its task: beliefs under an untrained flat policy.

    .venv/bin/python benchmarks/flailing.py

The cheetah acts by a flat policy with random weights, sampled as in training.
The table says how far the goal, read by the
module's probe, is from the true one.
"""

from pathlib import Path

import equinox as eqx
import jax
import numpy as np

from rebody.agents.build import build_agent
from rebody.agents.controller import Controller
from rebody.agents.parts import load_inference
from rebody.agents.rollout import rollout_on_robot
from rebody.bodies import load_robot
from rebody.control.flat import FlatView
from rebody.control.sac import Actor
from rebody.tasks.task_file import active_tasks, read_tasks
from rebody.training.flat import FlatConfig
from rebody.types import DECISION_DT

TASKS = Path(__file__).parent / "tasks"
FILES = {"position": "position-cheetah.json", "position-thesis": "position-thesis.json"}
DECISIONS = (1, 2, 3, 5, 10, 20, 50)


class Flailing(Controller):
    """A policy that has learned nothing, sampled."""

    actor: Actor
    key: jax.Array

    def see(self, batch):
        return batch.joint_state()

    def __call__(self, joints, pose, subgoal, belief):
        observation = FlatView(reach=10.0)(joints, pose, belief)
        # a fresh draw at every control step, from what the robot feels
        key = jax.random.fold_in(self.key, (1e4 * joints[0, -1]).astype(np.int32))
        return self.actor.sample(observation, key)[0]


def main() -> None:
    spec = load_robot("cheetah")
    print("| module | moved in 20 decisions, median [m] | " + " | ".join(f"{d} decisions" for d in DECISIONS) + " |")
    print("|---|---|" + "---|" * len(DECISIONS))
    for name, file in FILES.items():
        module = load_inference(name)
        families = module.contract.families
        specs = read_tasks(TASKS / file, families)
        tasks = active_tasks(specs, families, max(DECISIONS), DECISION_DT)
        features = 17 + 1 + 2 * module.parts.module.encoder.latent
        actor = eqx.filter_jit(Actor)(features, spec.model.nu, FlatConfig().sac, jax.random.key(0))
        controller = Flailing(actor, jax.random.key(1))
        episodes = rollout_on_robot(
            build_agent("flat", module), controller, spec, tasks, families, np.arange(len(specs))
        )
        _, read = module.parts.probe(episodes.belief)
        error = np.median(np.abs(np.asarray(read) - tasks.target)[..., 0], axis=1)
        moved = np.median(np.abs(np.asarray(episodes.state.x)[19]))
        cells = " | ".join(f"{error[d - 1]:.2f} m" for d in DECISIONS)
        print(f"| {name} | {moved:.2f} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
