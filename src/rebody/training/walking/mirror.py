"""Left and right: what a control step would have been in a mirror, where a description says that they are alike."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from rebody.bodies.walking.joints import JointInterface
from rebody.bodies.walking.settings import Term
from rebody.errors import RebodyError
from rebody.types import AnyArray

WAYS = (1.0, -1.0, -1.0)
"""Forward, sideways, turn."""
SIGNS: dict[Term, tuple[float, ...]] = {
    "linear_velocity": (1.0, -1.0, 1.0),
    "angular_velocity": (-1.0, 1.0, -1.0),
    "gravity": (1.0, -1.0, 1.0),
    "command": WAYS,
    "height": (1.0,),
}


class Mirror(eqx.Module):
    """Where each number of an observation and of an action is to be found, and with which sign."""

    observation: Int[np.ndarray, " number"]
    observation_sign: Float[np.ndarray, " number"]
    action: Int[np.ndarray, " joint"]
    action_sign: Float[np.ndarray, " joint"]

    def seen(self, numbers: Float[AnyArray, "*batch number"]) -> Float[AnyArray, "*batch number"]:
        """An observation as the mirror shows it."""
        return numbers[..., self.observation] * self.observation_sign

    def done(self, action: Float[AnyArray, "*batch joint"]) -> Float[AnyArray, "*batch joint"]:
        """An action as the mirror shows it."""
        return action[..., self.action] * self.action_sign

    def ways(self, numbers: Float[AnyArray, "*batch 3"]) -> Float[AnyArray, "*batch 3"]:
        """A command, or speeds, as the mirror shows them."""
        return numbers * jnp.asarray(WAYS)


def mirror_of(joints: JointInterface, named: tuple[str, ...], robot: str) -> Mirror | None:
    """That of a robot; None where its description names none. RebodyError where it does not name every joint once."""
    if not named:
        return None
    names = [name.removeprefix("-") for name in named]
    if sorted(names) != sorted(joints.names):
        raise RebodyError(
            f"robot '{robot}': [policy] mirror must name each of its joints once, behind a minus where it turns the "
            f"other way; those are {', '.join(joints.names)}."
        )
    action = np.array([joints.names.index(name) for name in names])
    sign = np.array([-1.0 if name.startswith("-") else 1.0 for name in named], np.float32)
    begin, index, signs = 0, [], []
    for term in joints.inputs:
        size = joints.size(term)
        index.append(begin + (np.arange(size) if term in SIGNS else action))
        signs.append(np.asarray(SIGNS.get(term, sign), np.float32))
        begin += size
    return Mirror(np.concatenate(index), np.concatenate(signs), action, sign)
