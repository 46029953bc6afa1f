"""The policy that is learned together with its inference module: (joint state, x, belief) -> joint action."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.high_level import Places, TaskCode, seen_from
from rebody.control.sac import Actor
from rebody.tasks.families import FAMILIES
from rebody.types import AnyArray, Belief


class ScratchPolicy(eqx.Module):
    """An actor with what it sees."""

    actor: Actor
    places: Places = eqx.field(static=True)

    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], x: Float[AnyArray, "*batch"], understood: Belief
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]; `understood` is what the decoder makes of a belief."""
        return self.actor(scratch_observation(self.places, joints, x, understood))


def scratch_observation(
    places: Places, joints: Float[AnyArray, "*batch joint"], x: Float[AnyArray, "*batch"], understood: Belief
) -> Float[AnyArray, "*batch feature"]:
    """Joint state, then the places that a belief speaks of: those of x from where the body is.

    How fast it moves and how it is pitched the joint state has already.
    """
    here = [x / unit if field == "x" else jnp.zeros_like(x) for field, unit in places]
    return jnp.concatenate([joints, seen_from(jnp.stack(here, axis=-1), understood)], axis=-1)


def observed(joints: int, places: Places) -> int:
    """How many numbers it sees, with so many of the joints."""
    return joints + 4 * len(places)


def told_code(places: Places) -> TaskCode:
    """How a task is put to the policy that is told it: as a belief without doubt that speaks of these places."""
    family_of = {family.field: index for index, family in enumerate(FAMILIES)}
    return TaskCode(tuple((family_of[field], unit) for field, unit in places))
