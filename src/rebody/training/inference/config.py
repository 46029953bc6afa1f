"""Settings of a meta-training run."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from msgspec import Meta

from rebody.agents.parts import module_places, told_view
from rebody.bodies.disturbance import Randomisation
from rebody.control.high_level import PolicyView
from rebody.control.sac import SACConfig
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig
from rebody.inference.mixture.settings import MixtureConfig
from rebody.ranges import Copies, Count, Decisions, Episodes, NotNegative, Number, Positive, Rate, Share
from rebody.tasks import FamilySet
from rebody.training.inference.laws import LawDistribution


@dataclass(frozen=True)
class ToldConfig:
    """How the policy that is told its task learns: by gradients through the toy."""

    updates: Number = 64
    """Updates in an iteration, until inference is frozen."""
    courses: Copies = 64
    """Toys that move in parallel."""
    decisions: Decisions = 24
    """Length of their courses: longer than it takes to brake."""
    near: Share = 0.5
    """Share of the courses that begin within a family's floor of their target, for the last centimetres."""
    learning_rate: Rate = 2e-3
    """Adam's step size at the start; a cosine takes it to a fiftieth."""


@dataclass(frozen=True)
class MetaConfig:
    """What is learned, on which tasks, and for how long."""

    families: FamilySet
    """What tasks there are, and what each pays."""
    inference: InferenceConfig
    """Encoder, decoder and their loss."""
    sac: SACConfig
    """The high-level policy's learning."""
    policy_fields: tuple[str, ...]
    """Fields of the global state that the policies see, beside the places that a split latent speaks of."""
    policy_scales: tuple[Positive, ...]
    """What each of them is divided by [m, m/s]."""
    acts_by: Literal["belief", "task"] = "belief"
    """What the high-level policy goes by. By beliefs it learns to act while little is known, and as exactly as they
    are; by tasks it is told what the likeliest one is, and needs sharp beliefs."""
    told: ToldConfig = field(default_factory=ToldConfig)
    """The learning of the policy that is told its task."""
    prior: Literal["gaussian", "mixture"] = "gaussian"
    """What the latent is drawn towards: one Gaussian, or a Dirichlet process mixture."""
    mixture: MixtureConfig = field(default_factory=MixtureConfig)
    """Settings of the mixture."""
    toy: Literal["mass-damper", "position", "full", "plane", "space"] = "mass-damper"
    """The body that everything is learned on."""
    arrival: NotNegative = 0.0
    """Added to the scaled reward r / reward_scale of the policy's learning when r = 0. It is a function of the reward
    alone, and pulls the last centimetres."""
    arrival_width: Positive = 0.1
    """Half of it is added at r = -arrival_width."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    """Disturbances of half of the episodes."""
    switch_share: Share = 0.0
    """Share of episodes in which the task changes once, at any decision."""
    laws: LawDistribution = field(default_factory=LawDistribution)
    """How the laws are drawn that episodes are paid by, for a module that hears any law."""
    observation_noise: NotNegative = 0.0
    """Variance of the noise on every observed field (thesis, captions of 6.20)."""
    start: tuple[NotNegative, NotNegative] = (12.0, 3.0)
    """Episodes start at uniformly random places [m] and velocities [m/s] within these along every axis, at any pitch
    that a toy can hold, and at any heading where it turns."""
    disturbed_start: tuple[NotNegative, NotNegative] | None = None
    """The same for disturbed episodes, which teach inference alone; by default as the others."""
    home_share: Share = 0.0
    """Share of episodes that start at home and at rest, as a robot does."""
    turn_probability: Share = 0.15
    """Chance per decision that a wandering toy changes its mind. It must come to see goals from both sides: while it
    stays on one, a belief in their mirror image explains all that it hears."""
    episodes: Copies = 48
    """Toys that move in parallel: the first half nominal, the other disturbed."""
    decisions: Decisions = 200
    """Length of an episode: 20 s, as long as it will be used, so that nothing that comes late is new."""
    groups: Copies = 8
    """Iterations whose episodes are kept for learning."""
    wander_iterations: Number = 12
    """Iterations at the start in which all toys wander and only inference learns."""
    joint_iterations: Number = 38
    """Iterations after that in which inference and the policy learn together."""
    policy_iterations: Number = 90
    """Iterations after that in which inference is frozen and the policy learns on."""
    evaluate_every: Count = 10
    """Iterations from one measurement on held-out tasks to the next."""
    held_out: Episodes = 200
    """Held-out tasks of a measurement."""
    held_out_at_end: Episodes = 500
    """Held-out tasks of the artifact's own figures."""
    held_out_s: Annotated[float, Meta(ge=6, le=3600)] = 20.0
    """Length of their episodes [s]; figures speak of the sixth second."""
    begins_at_start: Share = 0.3
    """Share of windows that begin with their episode, when nothing is known: the first decisions count."""
    inference_updates: Number = 128
    """Updates of encoder and decoder in an iteration."""
    policy_updates: Number = 512
    """Updates of the policy that goes by beliefs in an iteration."""

    def __post_init__(self):
        """RebodyError where a field has no scale, a scale no field, or no window fits into an episode."""
        pairs = (
            ("--policy-scales", self.policy_fields, self.policy_scales),
            ("--inference.scales", self.inference.fields, self.inference.scales),
        )
        for option, fields, scales in pairs:
            if len(set(fields)) < len(fields):
                raise RebodyError(f"{option} go with fields of which one comes twice: {', '.join(fields)}.")
            if len(fields) != len(scales):
                raise RebodyError(
                    f"{option} must give a number for each of {', '.join(fields)}: {len(fields)}, not {len(scales)}."
                )

        if self.prior == "mixture" and not self.mixture.fits(self.inference.clustered):
            raise RebodyError(
                f"--mixture.maximum {self.mixture.maximum} is too much for a latent of {self.inference.latent}."
            )
        if (self.inference.window or 1) > self.decisions:
            raise RebodyError(
                f"--inference.window {self.inference.window} is longer than --decisions {self.decisions}."
            )

    @property
    def policy_view(self) -> PolicyView:
        """What the policy sees.

        Where the latent is not split no place is seen as a distance, so it sees what the encoder sees as it is, too.
        """
        scales = dict(zip(self.policy_fields, self.policy_scales, strict=True))
        places = module_places(self.inference, self.families)
        if not places:
            scales = dict(zip(self.inference.fields, self.inference.scales, strict=True)) | scales
        return PolicyView(tuple(scales), tuple(scales.values()), places)

    @property
    def told_view(self) -> PolicyView:
        """What the policy that is told its task sees."""
        return told_view(self.policy_view, self.families)

    @property
    def inference_iterations(self) -> int:
        """Iterations after which the inference module is frozen."""
        return self.wander_iterations + self.joint_iterations

    @property
    def iterations(self) -> int:
        """Length of the run."""
        return self.inference_iterations + self.policy_iterations
