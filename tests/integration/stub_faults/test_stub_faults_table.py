"""Each fault in the table of docs/reference/faults.md occurs, and Palaestra reports it as the table says."""

import re
from pathlib import Path

import pytest

from palaestra_sim.faults.parser import KINDS

PAGE = Path(__file__).parents[3] / "docs/reference/faults.md"
ROW = re.compile(
    r"^\| (?P<title>[^|]+) \| `(?P<fault>[^`]+)` \| [^|]+ \| (?P<report>[^|]+) \|$", re.MULTILINE
)
FAULT_KINDS = {"dead", "hung", "wrong_data"}
DELAY_S = 0.05


def rows():
    """Return fault and report of each row of the table, as parameters."""
    text = PAGE.read_text().partition("## The kinds")[2].partition("## When")[0]
    return [pytest.param(row["fault"], row["report"], id=row["fault"]) for row in ROW.finditer(text)]


def test_the_table_names_every_kind_of_the_language():
    """A user must find every kind of fault in the table."""
    written = {row.values[0].partition(":")[0] for row in rows()}

    assert written == set(KINDS)


@pytest.mark.parametrize(("fault", "report"), rows())
def test_palaestra_reports_a_fault_as_the_table_says(player, fault, report):
    """The author of another client can test that client against this table, row by row."""
    played = player(fault).play()

    kind = None if played.fault is None else played.fault.kind
    assert kind == (report if report in FAULT_KINDS else None), played.fault
    assert (played.extra_steps > 0) == (report == "extra step")
    if report == "slow":
        assert max(played.durations_s) > DELAY_S
