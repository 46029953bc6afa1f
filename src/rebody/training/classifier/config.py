"""Settings of a slot classifier's training run."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ClassifierConfig:
    """One training run; everything happens on the toy."""

    episodes: int = 512
    """Episodes of 20 s that the module's own policy acts in, half of them disturbed as in its training."""
    switch_share: float = 0.5
    """Share of episodes in which the task changes once, at any decision."""
    hidden: tuple[int, ...] = (32,)
    """Units of each hidden layer."""
    learning_rate: float = 3e-3
    """Adam's step size."""
    batch_size: int = 512
    """Beliefs of one update."""
    updates: int = 100
    """Updates in an iteration."""
    iterations: int = 20
    """Length of the run."""
