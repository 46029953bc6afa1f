"""Settings of a training run in which a robot learns everything itself."""

from dataclasses import dataclass, field, replace

from rebody.agents.parts import module_places
from rebody.bodies.robot import Reach
from rebody.control.flat import FlatView
from rebody.control.places import Places
from rebody.control.sac import SACConfig
from rebody.control.tracker import TrackerReward
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig
from rebody.ranges import Copies, Count, Decisions, Episodes, NotNegative, Number, Seconds, Share
from rebody.tasks import FamilySet
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.presets import goal_velocity
from rebody.training.task_inference import within_reach


@dataclass(frozen=True)
class ScratchConfig:
    """One training run; the defaults spend the cheetah's control steps of a tracker and a high-level policy."""

    robots: Copies = 32
    """Copies that move in parallel."""
    decisions: Decisions = 100
    """Length of an episode: 10 s."""
    groups: Copies = 80
    """Iterations whose episodes are kept for learning."""
    iterations: Number = 512
    """Length of the run; an iteration is an episode of every robot."""
    evaluate_every: Count = 32
    """Iterations from one measurement on held-out tasks to the next."""
    held_out: Episodes = 100
    """Held-out tasks of a measurement."""
    held_out_s: Seconds = 20.0
    """Length of their episodes [s]."""
    refresh_every: Count = 8
    """Iterations after which today's encoder goes along all stored episodes again."""
    decides_every: Count = 4
    """Of so many robots one takes the most likely action, as it will when it is used."""
    inference_updates: Number = 64
    """Updates of encoder and decoder in an iteration."""
    policy_updates: Number = 384
    """Updates of the policy in an iteration."""
    start: NotNegative = 15.0
    """Episodes begin anywhere within this from x = 0 [m], so that the latent cannot take the start for the task."""
    switch_share: Share = 0.5
    """Share of episodes in which the task changes once, as on the toy."""
    told_share: Share = 0.5
    """Share of robots that are told their task, and of control steps that the policy learns from as if it were. While
    nothing is known, a policy that only believes learns to stand still, and from that the module learns nothing."""
    families: FamilySet = field(default_factory=lambda: goal_velocity().families)
    """What tasks there are, as far as the robot reaches, and what each pays."""
    inference: InferenceConfig = field(default_factory=lambda: goal_velocity().inference)
    """Encoder, decoder and their loss: those of the toy's module."""
    reward: TrackerReward = field(default_factory=lambda: TrackerReward(relative=0.5, arrival=0.2))
    """What the policy is paid: as a tracker that is told the hidden task. By relative errors:
    absolute errors of far goals dominate the return as long as goals are not told apart."""
    sac: SACConfig = field(default_factory=lambda: SACConfig(projections=8, decay_updates=195_000))
    """Hyperparameters of soft actor-critic."""

    def __post_init__(self):
        """RebodyError where a belief cannot say what who is told goes by."""
        if not self.inference.kinds:
            raise RebodyError("--inference.kinds must be at least 1: a told task is put as a belief about places.")

    @property
    def places(self) -> Places:
        """What a belief says the places of."""
        return module_places(self.inference, self.families)

    @property
    def view(self) -> FlatView:
        """What the policy sees."""
        return FlatView(self.places)

    def meta(self, reach: Reach) -> MetaConfig:
        """The toy's settings for episodes of robots: tasks within reach, one Gaussian as the prior."""
        return replace(
            goal_velocity(),
            families=within_reach(self.families, reach),
            inference=self.inference,
            prior="gaussian",
            switch_share=self.switch_share,
            episodes=self.robots,
            decisions=self.decisions,
            groups=self.groups,
            wander_iterations=0,
            joint_iterations=self.iterations,
            inference_updates=self.inference_updates,
        )
