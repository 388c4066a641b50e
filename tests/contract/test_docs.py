"""The examples on the pages of the documentation work as written."""

import re
from pathlib import Path

import pytest

import palaestra.api
from tests.pages import fenced

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    [
        *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY", "CHANGELOG")),
        ROOT / "charts/palaestra/README.md",
        *ROOT.glob("docs/**/*.md"),
    ]
)


def blocks(language, pages=PAGES):
    """Return every block of a language on the pages, as parameters that are named after the page."""
    return [
        pytest.param(text, id=f"{page.relative_to(ROOT).with_suffix('')}-{number}")
        for page in pages
        for number, (kind, text) in enumerate(fenced(page.read_text()))
        if kind == language
    ]


@pytest.mark.parametrize("text", blocks("python", [page for page in PAGES if page != ROOT / "README.md"]))
def test_python_runs(text):
    """A reader copies a block and runs it. README.md contains no Python block."""
    exec(compile(text, "<page>", "exec"), {})


@pytest.mark.parametrize("text", blocks("yaml"))
def test_whole_jobs_are_right(text):
    """A reader copies a complete job. A block with a part of a job is checked by the tests of its page."""
    if "kind: TrainingJob" in text:
        palaestra.api.load(text, "page")


@pytest.mark.parametrize("text", blocks("console"))
def test_every_verb_that_is_typed_exists(text):
    """A reader types the command, so the Makefile must have its target."""
    makefile = (ROOT / "Makefile").read_text()

    verbs = re.findall(r"^make (\w+)", text, re.MULTILINE)

    assert [verb for verb in verbs if f"\n{verb}:" not in makefile] == []
