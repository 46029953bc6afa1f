"""Settings of the mixture."""

from dataclasses import dataclass
from typing import Literal

from rebody.ranges import Copies, Count, Number, Positive

LARGEST = 10_000_000
"""Numbers in all covariances together."""


@dataclass(frozen=True)
class MixtureConfig:
    """The mixture that clusters the latent (thesis 5.3.2), refitted from a warm start in every iteration."""

    covariance_type: Literal["full", "diag"] = "full"
    """Whether components may lie aslant."""
    concentration: Positive = 5.0
    """gamma of v_k ~ Beta(1, gamma)."""
    prior_scale: Positive = 0.1
    """Variance that the prior expects of a component in each dimension."""
    components: Copies | None = None
    """A fixed number of components, for comparison; by default it is found."""
    points: Count = 2000
    """Beliefs of a fit."""
    from_decision: Number = 10
    """Beliefs are taken from this decision of an episode on, when something is known."""
    from_iteration: Number = 5
    """First iteration with a fit; before it the prior is N(0, I)."""
    maximum: Copies = 32
    """Components that the loss can take."""

    def fits(self, dimensions: int) -> bool:
        """Whether the covariances of so many dimensions can be held."""
        return self.maximum * dimensions**2 <= LARGEST
