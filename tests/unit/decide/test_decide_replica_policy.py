"""Three lists give the order in which the operator checks a replica; docs/explain/judging.md shows them."""

from palaestra.decide.replica_policy import REASONS, CheckKind
from tools.judging import page


def test_the_page_has_a_row_for_each_check_in_its_order():
    """A row has the number, the class, the name and the first line of the docstring of a check.

    `test_golden.py` compares the table with the page.
    """
    rows = page.table().splitlines()[2:]

    assert len(rows) == len(page.CHECKS)
    assert rows[1] == "| 2 | ended | `job_is_complete` | The Job is complete, and so is the training. |"


def test_the_first_line_of_a_check_fits_into_a_cell():
    """A vertical bar would break the row, and a check without a docstring would have an empty cell."""
    firsts = [check.__doc__.strip().splitlines()[0] for _, check in page.CHECKS if check.__doc__]

    assert len(firsts) == len(page.CHECKS)
    assert [first for first in firsts if "|" in first or not first.endswith(".")] == []


def test_each_check_is_in_one_list_once():
    """If a check is in a list twice, only its first position has an effect."""
    assert len({check for _, check in page.CHECKS}) == len(page.CHECKS)


def test_the_last_reason_always_holds():
    """A replica in any state must get a reason, so the last check of the list always applies."""
    assert REASONS[-1][0] is CheckKind.SHOWN
