"""Episodes that figures are drawn from: which agent on which body, on which hidden tasks."""

from collections.abc import Callable, Iterable

import numpy as np
from jaxtyping import Float

from rebody.agents.parts import (
    load_flat,
    load_high_level,
    load_inference,
    load_slots_of,
    load_tracker,
)
from rebody.bodies import load_robot
from rebody.bodies.camera import Camera
from rebody.bodies.robot import Reach
from rebody.bodies.toy_models import mass_damper_model
from rebody.bodies.toys import MassDamper
from rebody.evaluation.trial import Trial
from rebody.report.thesis.data import Data, join, on_goals, trajectories
from rebody.report.thesis.panels import EPISODES
from rebody.tasks.line import GOAL, LINE
from rebody.tasks.task_file import TaskSpec
from rebody.training.inference import PRESETS

Latents = Float[np.ndarray, "time episode latent"]
THESIS_GOALS = np.linspace(0.5, 10.0, 12)
GOALS = np.linspace(-10.0, 10.0, 12)
STRIDES = (10, 50, 100)
"""On the cheetah [control steps]."""
BALANCING_STRIDE = 5
"""0.1 s on robots that have to balance [control steps]."""
SECONDS = {1: 40.0, BALANCING_STRIDE: 20.0, 10: 80.0, 50: 350.0, 100: 700.0}
"""Long enough for each stride to arrive: it makes at most 0.1 m at a time."""
FROM = 20
"""First decision whose latent is shown."""
EVERY = 6
"""Decisions from one latent that is shown to the next."""
DRAWN = ("time_s", "position_m", "velocity_m_s", "pitch_rad", "family", "target")


def toy_picture() -> Data:
    """The toy as MuJoCo draws it."""
    model = mass_damper_model(MassDamper())
    camera = Camera(model, 480, 360)
    try:
        return {"picture": np.asarray(camera.picture(np.zeros(model.nq)))}
    finally:
        camera.close()


# section 6.3: hidden positions


def position_on_toy() -> Data:
    """`position-thesis` on the toy that it learned on."""
    return on_goals(Trial("reuse", load_inference("position-thesis"), LINE, None, None), THESIS_GOALS)


def flat_on_cheetah() -> Data:
    """The flat policy on the cheetah."""
    flat = load_flat("flat-position-cheetah")
    return on_goals(Trial("flat", load_inference("position"), LINE, load_robot("cheetah"), None, flat=flat), GOALS)


def thesis_on(robot: str, stride: int) -> Data:
    """`position-thesis` on a robot in thesis mode."""
    parts = load_inference("position-thesis"), LINE, load_robot(robot), load_tracker(f"tracker-{robot}")
    trial = Trial("reuse", *parts, seconds=SECONDS[stride], stride=stride, horizon=1, thesis=True)
    return on_goals(trial, THESIS_GOALS)


def ours_on(robot: str) -> Data:
    """`position` on a robot, a decision every 0.1 s."""
    parts = load_inference("position"), LINE, load_robot(robot), load_tracker(f"tracker-{robot}")
    return on_goals(Trial("reuse", *parts), THESIS_GOALS)


def strides_on_cheetah() -> Data:
    """Three strides, and our mode."""
    return join({str(stride): thesis_on("cheetah", stride) for stride in STRIDES} | {"ours": ours_on("cheetah")})


def positions_on(robot: str) -> Data:
    """Both modules on a robot that has to balance, each in its mode."""
    return join({"thesis": thesis_on(robot, BALANCING_STRIDE), "ours": ours_on(robot)})


# sections 6.4 and 6.5: several families


def tasks_of_each_kind(reach: Reach = (), preset: str = "goal-velocity") -> list[TaskSpec]:
    """Evenly spaced over each base task, as far as a body reaches: goals may lie farther off than it is shown them."""
    limits, specs = {name: box for name, box in reach if name != GOAL.name}, []
    for family in PRESETS[preset]().families:
        for box in family.targets:
            within = limits.get(family.name, box)
            ends = max(box.low[0], within.low[0]), min(box.high[0], within.high[0])
            specs += [TaskSpec(family.name, (float(target),)) for target in np.linspace(*ends, EPISODES)]
    return specs


def on_toy() -> Data:
    """`goal-velocity` on the toy."""
    return trajectories(Trial("reuse", load_inference("goal-velocity"), LINE, None, None), tasks_of_each_kind())


def on_robot(module: str, robot: str) -> Data:
    """A module with the toy's policy on a robot, on tasks of each kind that the robot is fast enough for."""
    inference, spec = load_inference(module), load_robot(robot)
    slots = load_slots_of(inference, None)
    trial = Trial("reuse", inference, LINE, spec, load_tracker(f"tracker-{robot}"), slots=slots)
    return trajectories(trial, tasks_of_each_kind(spec.reach))


def randomised(modules: Iterable[str]) -> Data:
    """Each of several modules on the cheetah."""
    return join({module: drawn(on_robot(module, "cheetah")) for module in modules})


def retrained(high_level: str) -> Data:
    """A high-level policy that was learned on a robot, on tasks of each kind that its tracker is fast enough for."""
    module, _, robot = high_level.removeprefix("high-level-").rpartition("-")
    spec, tracker = load_robot(robot), load_tracker(f"tracker-{robot}")
    trial = Trial("retrain", load_inference(module), LINE, spec, tracker, high_level=load_high_level(high_level))
    reach = tuple(tracker.tracker.families.ranges.items())
    return drawn(trajectories(trial, tasks_of_each_kind(reach, module.removesuffix("-noise-0"))))


def projections() -> Data:
    """Latents on the toy in two dimensions: by t-SNE as in the thesis, and by PCA."""
    # a second to import, which every command would wait for
    from sklearn.decomposition import PCA
    from sklearn.manifold import TSNE

    data = on_toy()
    latents = late_latents(data)
    return {name: data[name] for name in ("family", "target")} | {
        "tsne": in_plane(latents, TSNE(random_state=0).fit_transform),
        "pca": in_plane(latents, PCA(2).fit_transform),
    }


def with_latents(robot: str) -> Data:
    """`goal-velocity` on a robot, and its latents there and on the toy in the plane of the toy's main components."""
    from sklearn.decomposition import PCA

    episodes, plane = on_robot("goal-velocity", robot), PCA(2)
    return drawn(episodes) | {
        "toy_pca": in_plane(late_latents(on_toy()), plane.fit_transform),
        "pca": in_plane(late_latents(episodes), plane.transform),
    }


def late_latents(data: Data) -> Latents:
    """Those that are shown, when something is known."""
    return data["latent"][FROM::EVERY]


def in_plane(latents: Latents, projection: Callable[[np.ndarray], np.ndarray]) -> Float[np.ndarray, "time episode 2"]:
    """Latents by a projection of rows to two dimensions."""
    flat = projection(latents.reshape(-1, latents.shape[-1]))
    return flat.reshape(*latents.shape[:2], 2).astype(np.float32)


def drawn(episodes: Data) -> Data:
    """What the figures need of episodes."""
    return {name: episodes[name] for name in DRAWN}
