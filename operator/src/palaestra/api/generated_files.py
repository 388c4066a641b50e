"""The files of the repository that are generated from the models and the reasons."""

from pathlib import Path

from palaestra.api.crd import crd
from palaestra.api.generated_sections import between_marks
from palaestra.api.reason_texts import ROWS
from palaestra.api.reference import page
from palaestra.api.yaml_io import write

REASONS = "<!-- generated from the reasons: palaestra.api.generated_files -->"
_HEADER = "# Generated from operator/src/palaestra/api by `make golden`; edit the models instead.\n"


def crd_text() -> str:
    """Return the CustomResourceDefinition as YAML."""
    return write(crd())


def generated_files(root: Path) -> dict[str, str]:
    """Return the text of each generated file, by path relative to the repository's `root`.

    In the two pages of the documentation, only the tables are generated. All other text of these pages is
    read from the files below `root`.
    """
    reference, operations = "docs/reference/trainingjob.md", "docs/reference/reasons.md"
    return {
        "manifests/crd.yaml": _HEADER + crd_text(),
        "charts/palaestra/crd.yaml": _HEADER + crd_text(),
        reference: page((root / reference).read_text(encoding="utf-8")),
        operations: reasons_page((root / operations).read_text(encoding="utf-8")),
    }


def reasons_page(text: str) -> str:
    """Return the page docs/reference/reasons.md with a new table of reasons; `text` is the present page.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, REASONS, reasons_table())


def reasons_table() -> str:
    """Return the table with a row for each reason: type of its event, meaning, remedy."""
    rows = (
        f"| {reason} | {'Warning' if row.warning else 'Normal'} | {row.meaning} | {row.remedy} |"
        for reason, row in ROWS.items()
    )
    return "\n".join(("| reason | event | what it means | what to do |", "|---|---|---|---|", *rows, ""))
