"""A cart that is to learn what its joystick means."""

import pytest
from tests.walking import CART, CART_TOML

from rebody.bodies import load_robot
from rebody.bodies.walking import stick
from rebody.control.sac import SACConfig
from rebody.training.walking import WalkingConfig

LEARNS = CART_TOML.replace(
    'onnx = "cart.onnx"\ninputs = ["command"]',
    'artifact = "./learned"\ninputs = ["linear_velocity", "angular_velocity", "command"]\naction_scale = 12.0\n'
    'mirror = ["right", "left"]',
)


@pytest.fixture(autouse=True)
def measured_in_short(monkeypatch):
    """How fast a stick may move is measured after each training."""
    monkeypatch.setattr(stick, "SHAKEN_S", 1.0)


@pytest.fixture
def cart_path(tmp_path):
    """Its description; the artifact that it names is yet to be made."""
    assert "artifact" in LEARNS
    (tmp_path / "cart.xml").write_text(CART)
    (tmp_path / "cart.toml").write_text(LEARNS)
    return tmp_path / "cart.toml"


@pytest.fixture
def cart(cart_path):
    return load_robot(str(cart_path))


@pytest.fixture
def config():
    """A few iterations, small networks."""
    return WalkingConfig(
        robots=4,
        steps=6,
        updates=5,
        iterations=2,
        evaluate_every=1,
        held_out=3,
        held_out_s=2.2,
        final_held_out=3,
        final_s=2.2,
        replay=50,
        sac=SACConfig(hidden=(8, 8), batch_size=16),
    )
