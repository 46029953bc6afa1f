"""Presets hang together: what is asked can be seen, reached, and held by the toy."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.agents.parts import module_places
from rebody.bodies.disturbance import no_disturbance
from rebody.bodies.toys import make_toy
from rebody.control.high_level import PolicyView
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig
from rebody.tasks import SHIPPED
from rebody.training.inference import PRESETS
from rebody.training.inference.config import MixtureConfig

MOVES = {
    "mass-damper": {"x", "vx"},
    "position": {"x", "vx"},
    "full": {"x", "z", "pitch", "vx", "vz", "pitch_rate"},
    "plane": {"x", "y", "yaw", "vx", "vy", "yaw_rate"},
}
SHOWN_BY = {
    "goal": "x",
    "velocity": "x",
    "stand": "pitch",
    "jump": "vz",
    "place": "y",
    "velocity_xy": "vy",
    "heading": "yaw",
}
"""The field without which a family's reward could not be understood."""


LARGE = InferenceConfig(fields=("x", "vx"), scales=(1.0, 1.0), latent=300)


@pytest.fixture(params=PRESETS)
def preset(request):
    return PRESETS[request.param]()


def test_encoder_and_policy_see_what_moves(preset):
    inference = preset.inference
    families = preset.families
    places = {name for place in preset.policy_view.places for name in place.quantity.components}
    view = preset.policy_view
    for fields, scales in ((inference.fields, inference.scales), (view.fields, view.scales)):
        assert set(fields) <= MOVES[preset.toy]
        assert len(fields) == len(scales)
        assert {SHOWN_BY[family] for family in families.names} <= {*fields, *places}
    assert len(preset.told_view.places) == (len(families) if places else 0)


def test_tasks_can_be_done_by_the_toy(preset):
    toy = make_toy(preset.toy)
    assert set(preset.families.names) <= set(SHIPPED.names)
    for family, box in preset.families.ranges.items():
        assert box.low < box.high
        far = max(box.largest)
        if family in ("velocity", "velocity_xy"):
            assert far <= toy.max_force / toy.damping
        if family == "stand":
            assert far < toy.max_pitch
        if family == "jump":  # off the floor within a decision
            assert far <= 0.1 * (toy.max_lift / toy.mass - toy.gravity)
        if family in ("goal", "place"):  # episodes begin on either side of every goal
            assert far <= preset.start[0]


def test_a_split_latent_has_room_for_amounts(preset):
    assert 0 <= preset.inference.kinds < preset.inference.latent
    assert preset.inference.clustered == (preset.inference.kinds or preset.inference.latent)
    assert preset.inference.window is None or preset.inference.window <= preset.decisions


@pytest.mark.parametrize(("name", "variance"), [("0", 0.0), ("0.1", 0.1), ("0.2", 0.2)])
def test_noise_takes_the_place_of_all_disturbances(name, variance):
    noisy = PRESETS[f"goal-velocity-noise-{name}"]()
    assert noisy.observation_noise == variance
    drawn, nominal = noisy.randomisation.sample(jax.random.key(0), (50,)), no_disturbance((50,))
    for part in ("ripple_amplitude", "pitch_ripple", "across_ripple", "yaw_ripple", "lag", "gain", "state_noise"):
        np.testing.assert_array_equal(getattr(drawn, part), getattr(nominal, part))
    assert noisy.families == PRESETS["goal-velocity"]().families


def test_a_policy_without_places_sees_what_the_encoder_sees():
    whole = PRESETS["goal-velocity"]()
    assert whole.policy_view == PolicyView(("vx",), (3.0,), module_places(whole.inference, whole.families))
    unsplit = replace(whole, inference=replace(whole.inference, kinds=0))
    assert unsplit.policy_view == PolicyView(("x", "vx"), (10.0, 3.0))
    assert PRESETS["position"]().policy_view == PolicyView(("x", "vx"), (10.0, 3.5))


@pytest.mark.parametrize("option", ["--policy-scales", "--inference.scales"])
def test_every_field_has_its_scale(option):
    preset = PRESETS["goal-velocity"]()
    changes = {
        "--policy-scales": {"policy_scales": (1.0, 2.0)},
        "--inference.scales": {"inference": replace(preset.inference, scales=(10.0,))},
    }
    with pytest.raises(RebodyError, match=f"{option} must give a number for each of"):
        replace(preset, **changes[option])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"policy_fields": ("vx", "vx"), "policy_scales": (1.0, 1.0)}, "--policy-scales go with fields of which one"),
        ({"mixture": MixtureConfig(maximum=4096), "inference": LARGE}, "--mixture.maximum 4096 is too much"),
    ],
)
def test_what_no_artifact_may_say_is_not_trained(change, said):
    with pytest.raises(RebodyError, match=said):
        replace(PRESETS["goal-velocity"](), **change)
