"""Tasks are free, far enough apart, fair, and decided by their random numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.environments.arena import (
    APART_M,
    CLEARANCE_M,
    Task,
    chosen_task,
    draw_point,
    draw_task,
    free,
    gap,
)
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.base import RADIUS_M

seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds)
def test_every_task_can_be_done(seed):
    """Start and target leave the robot room, and are far enough apart to be a task."""
    task = draw_task(np.random.default_rng(seed))

    assert gap(task.start.x_m, task.start.y_m) >= RADIUS_M + CLEARANCE_M
    assert gap(*task.target) >= RADIUS_M + CLEARANCE_M
    assert math.dist((task.start.x_m, task.start.y_m), task.target) >= APART_M
    assert -math.pi < task.start.heading_rad <= math.pi


@given(seed=seeds)
def test_a_task_follows_from_its_random_numbers(seed):
    """The seed of an episode is all that has to be remembered of it."""
    assert draw_task(np.random.default_rng(seed)) == draw_task(np.random.default_rng(seed))


def test_tasks_are_spread_over_the_whole_floor():
    """Every quarter of the floor gets its share; a policy may not specialise."""
    random = np.random.default_rng(1)

    points = np.array([draw_point(random) for _ in range(2000)])
    quarters = [np.mean((points * signs > 0).all(axis=1)) for signs in ((1, 1), (-1, 1), (1, -1))]

    assert quarters == pytest.approx([0.25] * 3, abs=0.04)


@pytest.mark.parametrize(
    ("place", "expected_m"),
    [((0.0, 0.0), math.hypot(0.8, 0.8) - 0.25), ((1.9, 0.0), 0.1), ((0.8, 0.8), -0.25), ((3, 0), -1.0)],
)
def test_the_gap_is_to_the_nearest_wall_or_cylinder(place, expected_m):
    """Negative inside of one, so that one comparison tells free from not."""
    assert gap(*place) == pytest.approx(expected_m)


def test_a_place_is_free_if_the_robot_fits():
    """Between a cylinder and the wall it does, in a corner's last centimetres it does not."""
    assert free(1.3, 1.3)
    assert not free(1.9, 1.9)
    assert not free(0.8, 0.5)


def test_what_is_chosen_stays_and_the_rest_is_drawn_around_it():
    """A person who wants one start still gets targets that are a task from there."""
    random = np.random.default_rng(2)

    tasks = [chosen_task(random, {"start": [1.5, 0.0, 0.5]}) for _ in range(50)]

    assert {task.start for task in tasks} == {Pose(1.5, 0.0, 0.5)}
    assert len({task.target for task in tasks}) == 50
    assert all(math.dist((1.5, 0.0), task.target) >= APART_M for task in tasks)


@pytest.mark.parametrize(
    "form", [tuple, list, np.array, np.float32], ids=["tuple", "list", "array", "float32"]
)
def test_a_place_may_be_chosen_in_any_form_of_numbers(form):
    """Observations are arrays, so places that somebody computes are too."""
    task = chosen_task(np.random.default_rng(0), {"start": form((0.0, 0.5, 1.0)), "target": form((0.0, 0.0))})

    assert task == Task(start=Pose(0.0, 0.5, 1.0), target=(0.0, 0.0))


def test_both_may_be_chosen_even_if_they_are_near():
    """A caller that chooses both has a reason, for instance to test the last centimeters."""
    task = chosen_task(np.random.default_rng(0), {"start": Pose(0.0, 0.0, 0.0), "target": (0.1, 0.0)})

    assert task.target == (0.1, 0.0)


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"goal": (0, 0)}, "reset option 'goal' is not known; use start or target"),
        ({"target": (0.8, 0.8)}, r"target: \(0.8, 0.8\) is in a wall or a cylinder"),
        ({"start": (2.5, 0.0, 0.0)}, r"start: \(2.5, 0\) puts the robot in a wall or a cylinder"),
        ({"start": (1.9, 0.0, 0.0)}, r"start: \(1.9, 0\) puts the robot in a wall .* within 1.7714 m"),
        ({"start": (0.8, 0.35, 0.0)}, r"start: \(0.8, 0.35\) puts the robot in a wall"),
        ({"start": (math.nan, 0.0, 0.0)}, r"start: \(nan, 0\) puts the robot in a wall"),
        ({"target": (math.nan, 0.0)}, r"target: \(nan, 0\) is in a wall"),
        ({"start": (0.0, 0.0)}, r"start: \(0.0, 0.0\) is not 3 numbers; give x, y, heading"),
        ({"target": np.zeros((1, 2))}, r"target: .* is not 2 numbers; give x, y"),
        ({"target": "home"}, "target: 'home' is not 2 numbers"),
        ({"target": 1.0}, "target: 1.0 is not 2 numbers"),
    ],
    ids=["unknown", "cylinder", "wall", "in", "at", "nowhere", "nan", "too few", "matrix", "text", "number"],
)
def test_a_place_that_cannot_be_is_refused(chosen, message):
    """Rather than searched around for ever."""
    with pytest.raises(ConfigurationError, match=message):
        chosen_task(np.random.default_rng(0), chosen)
