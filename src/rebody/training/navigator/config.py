"""Settings of a navigator's training run."""

from dataclasses import dataclass, field

from rebody.bodies.walking.toy import Walkers
from rebody.ranges import Copies, Count, Decisions, Episodes, Layers, NotNegative, Number, Positive, Rate, Share


@dataclass(frozen=True)
class NavigatorConfig:
    """One training run; everything happens on the joystick toy."""

    walkers: Walkers = field(default_factory=Walkers)
    """What robots are like."""
    hidden: Layers = (128, 128)
    """Units of each hidden layer."""
    projections: Number = 16
    """Learned differences of the inputs that the network sees at several sharpnesses."""
    courses: Copies = 128
    """Robots of one update."""
    decisions: Decisions = 24
    """Length of their courses: longer than it takes to turn round or to brake. Gradients of long ones explode."""
    near: Share = 0.5
    """Share of the places that are asked for within half a metre, and of headings within half a radian."""
    far: Positive = 10.0
    """Farthest place [m]. It is shown nearer, as an agent shows it."""
    to_go_price: NotNegative = 1.0
    """Of what a subgoal will still cost at the end of a course: of a second to a place, of a metre that a velocity is
    missed by."""
    speed_price: NotNegative = 0.05
    """Of m/s while a heading is asked for: who turns stays where it is."""
    change_price: NotNegative = 0.1
    """Of changing the stick."""
    effort_price: NotNegative = 0.01
    """Of holding it: who has arrived lets it go."""
    learning_rate: Rate = 2e-3
    """Adam's step size at the start; a cosine takes it to a fiftieth."""
    updates: Count = 100
    """Updates in an iteration."""
    iterations: Number = 60
    """Length of the run."""
    held_out: Episodes = 500
    """Held-out courses of a measurement."""
