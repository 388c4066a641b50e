"""Durations, sparklines and tables as text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.view import lines_of, server_table, short, sparkline
from palaestra.view.sparkline import BARS


@pytest.mark.parametrize(
    ("seconds", "told"),
    [(-3, "0s"), (0.9, "0s"), (59, "59s"), (60, "1m"), (192, "3m12s"), (7500, "2h5m"), (273_600, "3d4h")],
)
def test_a_duration_is_shown_in_its_two_largest_units(seconds, told):
    """In a duration of a week, seconds do not matter."""
    assert short(seconds) == told


def test_a_duration_whose_second_unit_is_zero_has_one():
    """The third unit is never shown: 1 h and 5 s is `1h`, not `1h5s`."""
    assert short(3605) == "1h"


def test_the_line_rises_with_the_figures():
    """The lowest bar stands for the smallest value, the highest bar for the largest."""
    assert sparkline([0, 1, 2, 3, 4, 5, 6, 7]) == BARS


def test_equal_figures_are_neither_low_nor_high():
    """Equal values have no range, so their bars have a middle height."""
    assert sparkline([5.0, 5.0]) == "▅▅"


def test_what_is_not_known_is_a_gap():
    """An unknown value must not look like zero."""
    assert sparkline([0.0, None, 1.0]) == "▁ █"
    assert sparkline([None]) == " "


def test_a_scale_may_be_given():
    """A success rate of 0.5 is drawn half-way up, even if all rates were near 0.5."""
    assert sparkline([0.5, 0.51], lowest=0.0, highest=1.0) == "▅▅"


@given(st.lists(st.none() | st.floats(-1e9, 1e9), max_size=40))
def test_each_figure_has_one_character(values):
    """The bars of two lines then stand for the same times."""
    assert len(sparkline(values)) == len(values)
    assert set(sparkline(values)) <= set(BARS) | {" "}


def test_columns_stand_below_each_other_and_lines_end_without_blanks():
    """People paste these tables into issues."""
    assert lines_of([("A", "LONG"), ("wide", ""), ("b", "c")]) == ["A      LONG", "wide", "b      c"]


def test_a_table_of_the_server_is_shown_as_kubectl_shows_it():
    """The columns are those of the CRD, so both programs list the same values."""
    columns = [
        {"name": "Name", "priority": 0},
        {"name": "Step", "priority": 0},
        {"name": "Target", "priority": 1},
    ]
    row = {"cells": ["job", None, 50], "object": {"metadata": {"namespace": "lab"}}}
    table = {"columnDefinitions": columns, "rows": [row]}

    assert server_table(table) == ["NAME   STEP", "job    -"]
    assert server_table(table, wide=True) == ["NAME   STEP   TARGET", "job    -      50"]
    assert server_table(table, namespaces=True)[1] == "lab         job    -"
