"""Settings of a slot classifier's training run."""

from dataclasses import dataclass

from rebody.ranges import Copies, Count, Layers, Number, Rate, Share


@dataclass(frozen=True)
class ClassifierConfig:
    """One training run; everything happens on the toy."""

    episodes: Copies = 512
    """Episodes of 20 s that the module's own policy acts in, half of them disturbed as in its training."""
    switch_share: Share = 0.5
    """Share of episodes in which the task changes once, at any decision."""
    hidden: Layers = (32,)
    """Units of each hidden layer."""
    learning_rate: Rate = 3e-3
    """Adam's step size."""
    batch_size: Copies = 512
    """Beliefs of one update."""
    updates: Count = 100
    """Updates in an iteration."""
    iterations: Number = 20
    """Length of the run."""
