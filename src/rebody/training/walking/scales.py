"""Scales of what a walking policy hears: its networks learn on like sizes, its artifact takes numbers as they are."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.bodies.walking.joints import JointInterface
from rebody.bodies.walking.settings import Term
from rebody.bodies.walking.trained import TrainedPolicy
from rebody.control.sac import Actor, SACConfig
from rebody.errors import RebodyError

SCALES: dict[Term, float] = {"angular_velocity": 0.5, "joint_velocities": 0.05, "height": 3.0}
"""What some inputs are multiplied by."""


def input_scales(joints: JointInterface) -> Float[np.ndarray, " number"]:
    """Of each number that a policy hears."""
    return np.concatenate([np.full(joints.size(term), SCALES.get(term, 1.0), np.float32) for term in joints.inputs])


def network_of(actor: Actor, joints: JointInterface) -> dict[str, np.ndarray]:
    """Arrays of an artifact: the actor's network behind the scales."""
    mlp = actor.net.mlp
    first, *others = (np.asarray(weight) for weight in mlp.weights)
    weights = [first * input_scales(joints)[:, None], *others]
    return {f"weights.{i}": weight for i, weight in enumerate(weights)} | {
        f"biases.{i}": np.asarray(bias) for i, bias in enumerate(mlp.biases)
    }


def loaded_actor(artifact: str, joints: JointInterface, config: SACConfig) -> Actor:
    """The actor of an artifact; RebodyError where it is of other sizes, or hears something else."""
    policy = TrainedPolicy(artifact)
    settings = policy.settings
    if (settings.inputs, settings.joints, settings.hidden) != (joints.inputs, joints.names, config.hidden):
        raise RebodyError(f"cannot start from '{artifact}': it hears or moves something else, or has other layers.")
    (first, bias), *others = policy.layers
    layers = [(first / input_scales(joints)[:, None], bias), *others]
    weights, biases = (tuple(jnp.asarray(each) for each in part) for part in zip(*layers, strict=True))
    fresh = Actor(policy.observations, policy.actions, config, jax.random.key(0))
    return eqx.tree_at(lambda actor: (actor.net.mlp.weights, actor.net.mlp.biases), fresh, (weights, biases))
