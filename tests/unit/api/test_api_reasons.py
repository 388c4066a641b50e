"""Each reason of a status has a meaning, a message and a remedy, in one table."""

import re
import string

import pytest

from palaestra.api.generated_files import reasons_page, reasons_table
from palaestra.api.reason_texts import ROWS, say
from palaestra.api.reasons import LONGEST_MESSAGE, Reason


def test_every_reason_has_a_row() -> None:
    """A user who looks up a reason must find its meaning and its remedy."""
    assert set(ROWS) == set(Reason)


@pytest.mark.parametrize("reason", Reason)
def test_a_reason_is_one_word_for_programs(reason) -> None:
    """Kubernetes requires a CamelCase word as the reason of a condition."""
    assert re.fullmatch("[A-Z][A-Za-z]{2,39}", reason)


@pytest.mark.parametrize("reason", Reason)
def test_a_message_is_filled_in_and_stays_within_its_bounds(reason) -> None:
    """The facts in a message come from other programs and may have any length."""
    fields = {name for _, name, _, _ in string.Formatter().parse(ROWS[reason].message) if name}

    message = say(reason, **{name: f"\n{name}\x00 {'x' * 5000}" for name in fields})

    assert message.isprintable()
    assert len(message) <= LONGEST_MESSAGE


def test_a_message_that_lacks_a_fact_is_a_mistake_of_ours() -> None:
    """Without this error a user would read a message with unfilled braces."""
    with pytest.raises(KeyError):
        say(Reason.IMAGE_PULL)


@pytest.mark.parametrize("reason", Reason)
def test_a_row_is_one_line_of_a_table(reason) -> None:
    """A vertical bar or a line break in a cell would break the Markdown table."""
    row = ROWS[reason]

    assert row.meaning
    assert row.remedy
    assert not set("|\n") & set(row.meaning + row.remedy)


def test_operations_has_a_row_for_each_reason(repository) -> None:
    """A reader of a status looks up the reason on the page and finds the remedy."""
    text = (repository / "docs/reference/reasons.md").read_text()

    assert reasons_table() in text
    assert reasons_page(text) == text
    assert all(f"| {reason} |" in text for reason in Reason)


def test_a_page_without_its_marks_raises_an_error() -> None:
    """Without this error the page would lack its table, and nobody would notice."""
    with pytest.raises(ValueError, match=r"lacks <!-- generated from the reasons.*; add both"):
        reasons_page("# Operations")
