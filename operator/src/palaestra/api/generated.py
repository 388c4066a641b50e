"""The files of the repository that are made from the models, as they should be."""

from pathlib import Path

from palaestra.api.crd import crd
from palaestra.api.reason_table import page as reasons_page
from palaestra.api.reference import page
from palaestra.api.yaml_text import write

_HEADER = "# Generated from operator/src/palaestra/api by `make golden`; edit the models instead.\n"


def crd_text() -> str:
    """Return the CustomResourceDefinition as YAML."""
    return write(crd())


def generated_files(root: Path) -> dict[str, str]:
    """Return path, relative to the repository's `root`, and text of each generated file.

    Only the tables of the two pages are generated; the rest of them is read from `root`.
    """
    reference, operations = "docs/trainingjob.md", "docs/operations.md"
    return {
        "manifests/crd.yaml": _HEADER + crd_text(),
        "charts/palaestra/crd.yaml": _HEADER + crd_text(),
        reference: page((root / reference).read_text(encoding="utf-8")),
        operations: reasons_page((root / operations).read_text(encoding="utf-8")),
    }
