"""The table of reasons in docs/operations.md, made from `palaestra.api.reasons`."""

from palaestra.api.marks import between_marks
from palaestra.api.reasons import ROWS

BEGIN = "<!-- generated from the reasons: palaestra.api.reason_table -->"


def page(text: str) -> str:
    """Return docs/operations.md, of which `text` is what it was, with its table of reasons made anew.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, table())


def table() -> str:
    """Return a row for each reason: what it means, what to do, and of which type its event is."""
    rows = (
        f"| {reason} | {'Warning' if row.warning else 'Normal'} | {row.meaning} | {row.remedy} |"
        for reason, row in ROWS.items()
    )
    return "\n".join(("| reason | event | what it means | what to do |", "|---|---|---|---|", *rows, ""))
