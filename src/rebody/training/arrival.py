"""What pulls a high-level policy's last centimetres."""

from jaxtyping import Float

from rebody.types import AnyArray


def arrival_bonus(reward: Float[AnyArray, "*batch"], height: float, width: float) -> Float[AnyArray, "*batch"]:
    """`height` where a reward is 0, half of it at -`width`: a function of the reward alone, so no task is told."""
    return height * width / (width - reward)
