"""A cart of our own, described as a stranger would."""

import pytest
from tests.walking import write_cart

from rebody.bodies import load_robot

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")


@pytest.fixture(scope="session")
def cart(tmp_path_factory):
    """Its description."""
    return load_robot(str(write_cart(tmp_path_factory.mktemp("cart"))))
