"""Placement of start and target: free of obstacles, far enough apart, fair, and reproducible."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.environments.placement import APART_M, CLEARANCE_M, EpisodeTask, FreePlaces
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots import FloorLayout, Obstacle, Pose
from palaestra_trainer.robots.base import OUTLINE_M
from palaestra_trainer.testing.fake_scene import arena

seeds = st.integers(0, 2**32 - 1)
ARENA = arena()
PLACES = FreePlaces(layout=ARENA, radius_m=OUTLINE_M)


@given(seed=seeds)
def test_every_task_can_be_done(seed):
    """In an episode that begins at the target or in an obstacle, a policy learns nothing."""
    task = PLACES.draw_task(np.random.default_rng(seed))

    assert ARENA.gap(task.start.x_m, task.start.y_m) >= OUTLINE_M + CLEARANCE_M
    assert ARENA.gap(*task.target) >= OUTLINE_M + CLEARANCE_M
    assert math.dist((task.start.x_m, task.start.y_m), task.target) >= APART_M
    assert -math.pi < task.start.heading_rad <= math.pi


@given(seed=seeds)
def test_a_task_follows_from_its_random_numbers(seed):
    """The seed of an episode is then enough to repeat the episode."""
    assert PLACES.draw_task(np.random.default_rng(seed)) == PLACES.draw_task(np.random.default_rng(seed))


def test_tasks_are_spread_over_the_whole_floor():
    """If a quarter of the floor were rare, the policy would specialize on the others."""
    random = np.random.default_rng(1)

    points = np.array([PLACES.draw(random) for _ in range(2000)])
    quarters = [np.mean((points * signs > 0).all(axis=1)) for signs in ((1, 1), (-1, 1), (1, -1))]

    assert quarters == pytest.approx([0.25] * 3, abs=0.04)


@pytest.mark.parametrize(
    ("place", "expected_m"),
    [((0.0, 0.0), math.hypot(0.8, 0.8) - 0.25), ((1.9, 0.0), 0.1), ((0.8, 0.8), -0.25), ((3, 0), -1.0)],
)
def test_the_gap_is_to_the_nearest_wall_or_cylinder(place, expected_m):
    """The gap is negative inside an obstacle, so its sign shows whether a point is free."""
    assert ARENA.gap(*place) == pytest.approx(expected_m)


def test_a_place_is_free_if_the_robot_fits():
    """The robot fits between a cylinder and the wall, but not into a corner."""
    assert PLACES.free(1.3, 1.3)
    assert not PLACES.free(1.9, 1.9)
    assert not PLACES.free(0.8, 0.5)


def test_what_is_chosen_stays_and_the_rest_is_drawn_around_it():
    """If a person sets only the start, the target is still drawn at a sufficient distance."""
    random = np.random.default_rng(2)

    tasks = [PLACES.chosen_task(random, {"start": [1.5, 0.0, 0.5]}) for _ in range(50)]

    assert {task.start for task in tasks} == {Pose(1.5, 0.0, 0.5)}
    assert len({task.target for task in tasks}) == 50
    assert all(math.dist((1.5, 0.0), task.target) >= APART_M for task in tasks)


@pytest.mark.parametrize(
    "form", [tuple, list, np.array, np.float32], ids=["tuple", "list", "array", "float32"]
)
def test_a_place_may_be_chosen_in_any_form_of_numbers(form):
    """A program may compute a position as a NumPy array, as observations are."""
    task = PLACES.chosen_task(
        np.random.default_rng(0), {"start": form((0.0, 0.5, 1.0)), "target": form((0.0, 0.0))}
    )

    assert task == EpisodeTask(start=Pose(0.0, 0.5, 1.0), target=(0.0, 0.0))


def test_both_may_be_chosen_even_if_they_are_near():
    """A person who sets both has a reason, for example a test of the last centimeters."""
    task = PLACES.chosen_task(np.random.default_rng(0), {"start": Pose(0.0, 0.0, 0.0), "target": (0.1, 0.0)})

    assert task.target == (0.1, 0.0)


def test_the_options_that_every_reset_of_a_run_gets_change_nothing():
    """A run passes these options for environments with a curriculum; this task has no curriculum."""
    of_a_run = {"training_progress": 0.5, "episode": 7}

    tasks = [PLACES.chosen_task(np.random.default_rng(0), chosen) for chosen in ({}, of_a_run)]

    assert tasks[0] == tasks[1]


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"goal": (0, 0)}, "reset option 'goal' is not known; use start or target"),
        ({"target": (0.8, 0.8)}, r"target: \(0.8, 0.8\) is in an obstacle"),
        ({"start": (2.5, 0.0, 0.0)}, r"start: \(2.5, 0\) puts the robot in an obstacle"),
        (
            {"start": (1.9, 0.0, 0.0)},
            r"start: \(1.9, 0\) puts the robot in an obstacle .* x from -1.7714 to 1.7714",
        ),
        ({"start": (0.8, 0.35, 0.0)}, r"start: \(0.8, 0.35\) puts the robot in an obstacle"),
        ({"start": (math.nan, 0.0, 0.0)}, r"start: \(nan, 0\) puts the robot in an obstacle"),
        ({"target": (math.nan, 0.0)}, r"target: \(nan, 0\) is in an obstacle"),
        ({"start": (0.0, 0.0)}, r"start: \(0.0, 0.0\) is not 3 numbers; give x, y, heading"),
        ({"target": np.zeros((1, 2))}, r"target: .* is not 2 numbers; give x, y"),
        ({"target": "home"}, "target: 'home' is not 2 numbers"),
        ({"target": 1.0}, "target: 1.0 is not 2 numbers"),
    ],
    ids=["unknown", "cylinder", "wall", "in", "at", "nowhere", "nan", "too few", "matrix", "text", "number"],
)
def test_a_place_that_cannot_be_is_refused(chosen, message):
    """With such a position, the search for a free position would never end."""
    with pytest.raises(ConfigurationError, match=message):
        PLACES.chosen_task(np.random.default_rng(0), chosen)


@given(x_m=st.floats(-1.5, 1.5), y_m=st.floats(-1.5, 1.5), heading_rad=st.floats(-3.0, 3.0), seed=seeds)
def test_a_start_is_never_drawn_inside_a_thing_wherever_it_was_moved(x_m, y_m, heading_rad, seed):
    """The current poses of obstacles count. A box may also be turned."""
    box = Obstacle(
        name="BOX", x_m=x_m, y_m=y_m, bottom_m=0.0, top_m=0.2, half_m=(0.5, 0.1), heading_rad=heading_rad
    )
    layout = FloorLayout(low=(-2.0, -2.0), high=(2.0, 2.0), obstacles=(box,))

    task = FreePlaces(layout=layout, radius_m=0.2).draw_task(np.random.default_rng(seed))

    assert box.gap(task.start.x_m, task.start.y_m) >= 0.3
    assert box.gap(*task.target) >= 0.3


def test_what_is_stored_under_the_floor_or_hangs_above_is_in_nobody_s_way():
    """The world `seeing` keeps its cylinders below the floor."""
    thing = ARENA.obstacles[0]

    for height_m in (-0.7, 2.0):
        moved = FloorLayout(low=ARENA.low, high=ARENA.high, obstacles=(thing.moved(0.0, 0.0, height_m),))
        assert moved.gap(0.0, 0.0) == 2.0


def test_a_floor_without_room_is_refused():
    """On such a floor, the search for a free position would never end."""
    tiny = FloorLayout(low=(-0.5, -0.5), high=(0.5, 0.5))

    with pytest.raises(ConfigurationError, match="no free places for a robot"):
        FreePlaces(layout=tiny, radius_m=OUTLINE_M).draw_task(np.random.default_rng(1))
