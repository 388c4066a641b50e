"""The newest readings of a robot, when they arrive in another order than they were measured."""

import math

import numpy as np
import pytest

from palaestra_trainer.real_robots.readings import Odometry, ReadingStore
from palaestra_trainer.robots.geometry import Pose

NEW, OLD = np.ones(9, np.float32), np.zeros(9, np.float32)
PICTURE, OLD_PICTURE = np.ones((2, 2, 3), np.uint8), np.zeros((2, 2, 3), np.uint8)
THERE, HERE = Odometry(Pose(1.0, 0.0, 0.0)), Odometry(Pose(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("kind", "newer", "older"),
    [("odometry", THERE, HERE), ("distances", NEW, OLD), ("image", PICTURE, OLD_PICTURE)],
)
def test_a_reading_that_arrives_after_a_newer_one_is_ignored(kind, newer, older):
    """Two connections of one robot are not ordered, and an old pose would look like a jump backward."""
    store = ReadingStore()
    store_reading = getattr(store, f"set_{kind}")

    store_reading(newer, 2.0)
    store_reading(older, 1.0)

    assert getattr(store.newest, {"distances": "distances_m"}.get(kind, kind)) is newer
    assert getattr(store.newest, f"{kind}_s") == 2.0


def test_an_old_state_of_the_bumper_does_not_hide_a_newer_touch():
    """A robot that touches something must not drive on because of a late packet."""
    store = ReadingStore()

    store.set_bumped(2.0, bumped=True)
    store.set_bumped(1.0, bumped=False)

    assert store.newest.bumped
    assert store.newest.bumped_s == 2.0


def test_the_readings_are_complete_only_with_every_kind():
    """The robot must not be driven while its bumper or its distances are unknown."""
    store = ReadingStore()
    store.set_odometry(HERE, 3.0)
    store.set_distances(NEW, 1.0)

    assert store.newest.oldest_s == -math.inf
    store.set_bumped(2.0, bumped=False)
    assert store.newest.oldest_s == 1.0
