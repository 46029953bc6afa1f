"""Damage, as disks and cables do it."""

import pytest


@pytest.fixture
def flip():
    """A function (data, position) -> data with the lowest bit of one byte flipped."""
    return lambda data, i: data[:i] + bytes([data[i] ^ 1]) + data[i + 1 :]
