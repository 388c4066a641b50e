"""The environment's docstring is a data sheet, which these tests compare with the code."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.environments import MoveToTargetEnv, MoveToTargetOptions
from palaestra_trainer.environments.actions import SCALE
from palaestra_trainer.environments.move_to_target import REACHED_M, STANDING_M_S
from palaestra_trainer.environments.observation import PARTS
from palaestra_trainer.environments.options import ACTIONS
from palaestra_trainer.environments.rewards import MARGIN_M, TERMS, WEIGHTS, EpisodeOutcome, Transition
from palaestra_trainer.robots import Movement
from palaestra_trainer.robots.base import SENSOR_RANGE_M
from palaestra_trainer.testing import fake_arena

SHEET = inspect.getdoc(MoveToTargetEnv) or ""
EXAMPLE = Path(__file__).parents[4] / "manifests" / "examples" / "move-to-target.yaml"
Row = dict[str, str]


def tables() -> Iterator[list[Row]]:
    """Yield the tables in the docstring; each row is a dictionary by column."""
    lines = [line.strip() for line in SHEET.splitlines()]
    for is_table, group in itertools.groupby(lines, key=lambda line: line.startswith("|")):
        if is_table:
            head, _, *body = ([cell.strip() for cell in line[1:-1].split("|")] for line in group)
            yield [dict(zip(head, cells, strict=True)) for cells in body]


MOVEMENTS, TWIST, OBSERVATION, REWARD = tables()


def bounds(part: str, column: str) -> list[float]:
    """Return the bounds of a part of the observation, one for each number, from a column of the sheet."""
    numbers: dict[int, float] = {}
    for row in OBSERVATION:
        if row["part"] == part:
            first, _, last = row["index"].partition("-")
            numbers |= dict.fromkeys(range(int(first), int(last or first) + 1), float(row[column]))
    assert list(numbers) == list(range(len(numbers))), "an index is missing or out of order"
    return list(numbers.values())


CHOICES = [choice for size in range(1, len(PARTS) + 1) for choice in itertools.permutations(PARTS, size)]


def test_the_sheet_knows_the_parts_in_their_order():
    """The sheet describes each part of the observation, and no part that was removed."""
    assert list(dict.fromkeys(row["part"] for row in OBSERVATION)) == list(PARTS)


def test_the_space_of_every_choice_of_parts_is_the_one_on_the_sheet():
    """A user finds a number of the observation by the sheet, whatever parts the job selects."""
    robot, scene = fake_arena()
    for choice in CHOICES:
        space = MoveToTargetEnv(robot, scene, MoveToTargetOptions(observe=choice)).observation_space

        assert isinstance(space, spaces.Box)
        assert space.low.tolist() == [it for part in choice for it in bounds(part, "min")]
        assert space.high.tolist() == [it for part in choice for it in bounds(part, "max")]
        assert space.dtype == np.float32


def test_movements_are_on_the_sheet_with_their_speeds():
    """The number of a row in the table is the number of the action."""
    on_the_sheet = [
        (int(action), name, (float(forward), float(left), float(turning)))
        for action, name, forward, left, turning in (row.values() for row in MOVEMENTS)
    ]

    assert on_the_sheet == [(it.value, it.name, it.twist) for it in Movement]


def test_the_continuous_action_is_on_the_sheet_with_its_units():
    """The unit column gives the velocity that an action of 1 means."""
    space = MoveToTargetEnv(*fake_arena(), MoveToTargetOptions(actions="continuous")).action_space

    assert isinstance(space, spaces.Box)
    assert space.low.tolist() == [float(row["min"]) for row in TWIST]
    assert space.high.tolist() == [float(row["max"]) for row in TWIST]
    assert [float(row["unit"].split()[0]) for row in TWIST] == list(SCALE)


def test_rewards_are_on_the_sheet_with_their_weights():
    """An empty cell means that this reward does not have the term."""
    assert [row["term"] for row in REWARD] == list(TERMS)
    for reward, weights in WEIGHTS.items():
        assert {row["term"]: float(row[reward]) for row in REWARD if row[reward]} == weights


@given(
    driven_m=st.floats(-0.1, 0.1),
    nearest_m=st.floats(SENSOR_RANGE_M[0], SENSOR_RANGE_M[1]),
    outcome=st.sampled_from(EpisodeOutcome),
)
def test_terms_stay_in_the_ranges_on_the_sheet(driven_m, nearest_m, outcome):
    """The weight of a term is chosen for its range. The robot drives at most a tenth of a meter per step."""
    step = Transition(before_m=1.0, after_m=1.0 - driven_m, nearest_m=nearest_m, outcome=outcome)

    for row in REWARD:
        worth = TERMS[row["term"]](step)

        assert float(row["min"]) - 1e-9 <= worth <= float(row["max"]) + 1e-9


@pytest.mark.parametrize("distance", [SENSOR_RANGE_M[0], MARGIN_M])
def test_the_range_of_proximity_is_on_the_sheet(distance):
    """A user who tunes the reward needs the distances at which the cost begins and is greatest."""
    (row,) = (row for row in REWARD if row["term"] == "proximity")

    assert f"{distance:.2f}" in row["is"]


def test_the_example_chooses_the_movements_that_the_sheet_says():
    """The example uses the first five movements, because a Robotino need not turn."""
    job = yaml.safe_load(EXAMPLE.read_text())
    chosen = job["spec"]["trainer"]["environment"]["options"]["movements"]

    assert "move-to-target.yaml chooses the first five" in SHEET
    assert chosen == [row["movement"] for row in MOVEMENTS[:5]]


@pytest.mark.parametrize("constant", [f"{REACHED_M:.2f} m", f"{STANDING_M_S:.2f} m/s"])
def test_the_task_is_on_the_sheet_with_its_numbers(constant):
    """A user must find in the docstring when the target counts as reached."""
    assert constant in SHEET


@pytest.mark.parametrize("word", [*(f'actions="{it}"' for it in ACTIONS), "max_steps", "observe", "time_up"])
def test_options_are_on_the_sheet(word):
    """A user finds out from the docstring which options a job may set."""
    assert f"`{word}`" in SHEET
