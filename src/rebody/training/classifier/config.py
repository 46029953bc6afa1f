"""Settings of a slot classifier's training run."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from rebody.ranges import Copies, Count, Episodes, Layers, Number, Rate, Share


@dataclass(frozen=True)
class ClassifierConfig:
    """One training run; everything happens on the toy."""

    episodes: Copies = 512
    """Episodes that the module's own policy acts in, half of them disturbed as in its training."""
    decisions: Annotated[int, Meta(ge=21, le=36_000)] = 200
    """Length of an episode, in training and measurement: longer than it takes to know something."""
    held_out: Episodes = 200
    """Held-out episodes of a measurement."""
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
