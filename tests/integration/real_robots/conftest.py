"""A mock robot that the tests of a file share."""

import pytest

from tests.mock_robots import SPEED, ended, settled, started


@pytest.fixture(scope="module")
def running():
    """Yield a client of a fast mock robot with a perfect odometry, which all tests of a file share."""
    process, client = started(f"--speed={SPEED:g}", "--drift=0")
    yield client
    ended(process, client)


@pytest.fixture
def mock(running):
    """Return the client of a robot that stands in the middle of the arena, without a charger."""
    return settled(running)
