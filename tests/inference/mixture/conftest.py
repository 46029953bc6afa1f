"""What tests of the mixture share."""

import jaxtyping
import pytest


@pytest.fixture
def as_users_call():
    """Without the checks of shapes and types that only tests have: for wrong arguments, and for long fits."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
