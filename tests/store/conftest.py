"""Damage, as disks and cables do it."""

import resource
from contextlib import contextmanager

import pytest


@pytest.fixture
def flip():
    """A function (data, position) -> data with the lowest bit of one byte flipped."""
    return lambda data, i: data[:i] + bytes([data[i] ^ 1]) + data[i + 1 :]


@pytest.fixture
def little_space():
    """A context (bytes): while inside, no file can grow beyond that, much as on a full disk."""

    @contextmanager
    def little_space(size):
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return little_space
