"""The table of checks on a replica in docs/explain/judging.md, with a row for each check of the operator."""

from __future__ import annotations

from palaestra.api.generated_sections import between_marks
from palaestra.decide.replica_policy import ENDS, REASONS, STOPS

PAGE = "docs/explain/judging.md"
BEGIN = "<!-- generated: checks on a replica -->"
CHECKS = (
    *(("ended", check) for check in ENDS),
    *(("final", check) for check in STOPS),
    *((kind.value, check) for kind, check in REASONS),
)


def page(text: str) -> str:
    """Return docs/explain/judging.md with a new list; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, table())


def table() -> str:
    """Return a row for each check, in the order of the lists: class, name, first line of the docstring."""
    rows = (
        f"| {number} | {kind} | `{check.__name__}` | {(check.__doc__ or '').strip().splitlines()[0]} |"
        for number, (kind, check) in enumerate(CHECKS, 1)
    )
    return "\n".join(("| # | class | check | what it finds |", "|---|---|---|---|", *rows, ""))
