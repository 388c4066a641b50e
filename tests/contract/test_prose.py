"""Every sentence for readers obeys the rules of `tests.contract.prose`."""

from __future__ import annotations

from pathlib import Path

import pytest

from palaestra.api.reason_texts import ROWS
from tests.contract.prose import files, findings

ROOT = Path(__file__).parents[2]
SOURCES = ("operator/src", "sim_image/src", "trainer/src")
PAGES = ("docs", "README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "charts")


@pytest.mark.parametrize("place", [*SOURCES, *PAGES])
def test_no_sentence_needs_a_second_reading(place):
    """People in a hurry read docstrings, comments and messages as often as pages."""
    found = [finding for path in files([ROOT / place]) for finding in findings(path)]

    assert not found, "\n".join(map(str, found))


@pytest.mark.parametrize("reason", ROWS)
def test_no_reason_needs_a_second_reading(reason, tmp_path):
    """docs/reference/reasons.md shows the reasons in a table, and the test of the pages skips tables."""
    page = tmp_path / "row.md"
    row = ROWS[reason]
    page.write_text(f"{row.meaning}\n\n{row.remedy}\n")

    assert not findings(page)


@pytest.mark.parametrize(
    "planted",
    [
        "Whoever reads this looks twice.",
        "It is told by the pod.",
        "The operator tells of it.",
        "What is kept here is read there.",
        "Who leads is decided by a lease.",
        f"It goes on{' and on' * 18}.",
    ],
)
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("page.md", "{}\n"),
        ("docstring.py", '"""{}"""\n'),
        ("comment.py", "# {}\nx = 1  # a number\n"),
        ("behind.py", "x = 1  # {}\n"),
        ("message.py", 'raise ValueError("{}")\n'),
        ("values.yaml", "# {}\nreplicas: 1\n"),
    ],
)
def test_a_planted_sentence_is_found(planted, name, text, tmp_path):
    """If a rule contained a mistake, it could find nothing, and every sentence would pass."""
    path = tmp_path / name
    path.write_text(text.format(planted))

    assert findings(path)


def test_tables_and_code_in_a_docstring_are_no_sentences(tmp_path):
    """An indented block after an empty line is code or a table. A list of arguments is indented prose."""
    path = tmp_path / "blocks.py"
    path.write_text(
        '"""Return a table.\n\n    What is    a cell\n\n    Who leads  another\n\n'
        'Args:\n    it: whoever reads.\n"""\n'
    )

    assert [finding.text for finding in findings(path)] == ["whoever reads."]
