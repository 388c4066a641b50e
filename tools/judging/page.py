"""The checks on a replica, in docs/explain/judging.md: a row for each row of the operator's own list."""

from __future__ import annotations

from palaestra.api.generated_sections import between_marks
from palaestra.decide.replica_policy import JUDGED

PAGE = "docs/explain/judging.md"
BEGIN = "<!-- generated: checks on a replica -->"


def page(text: str) -> str:
    """Return docs/explain/judging.md, now `text`, with the list made anew.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, table())


def table() -> str:
    """Return a row for each check in its order: class, name, and the first line of its docstring."""
    rows = (
        f"| {number} | {kind.value} | `{check.__name__}` | {(check.__doc__ or '').strip().splitlines()[0]} |"
        for number, (kind, check) in enumerate(JUDGED, 1)
    )
    return "\n".join(("| # | class | check | what it finds |", "|---|---|---|---|", *rows, ""))
