"""One list is the order in which a replica is checked; docs/explain/judging.md shows it."""

from palaestra.decide.replica_policy import JUDGED, CheckKind
from tools.judging import page


def test_the_page_has_a_row_for_each_check_in_its_order():
    """A row has number, class, name and the first line of the docstring.

    Test_golden.py compares it with the file.
    """
    rows = page.table().splitlines()[2:]

    assert len(rows) == len(JUDGED)
    assert rows[1] == "| 2 | ended | `job_is_complete` | The Job is complete, and so is the training. |"


def test_the_first_line_of_a_check_fits_into_a_cell():
    """A bar would break the row, and a check without a docstring would have an empty cell."""
    firsts = [check.__doc__.strip().splitlines()[0] for _, check in JUDGED if check.__doc__]

    assert len(firsts) == len(JUDGED)
    assert [first for first in firsts if "|" in first or not first.endswith(".")] == []


def test_each_check_is_in_the_list_once():
    """If a check is in the list twice, only its first position has an effect."""
    assert len({check for _, check in JUDGED}) == len(JUDGED)


def test_the_last_row_always_holds():
    """Whatever state a replica has, its status must report one."""
    assert JUDGED[-1][0] is CheckKind.SHOWN
