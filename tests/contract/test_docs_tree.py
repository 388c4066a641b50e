"""A reader reaches each page of docs/ from docs/README.md, and no link of a page is broken."""

import re
import subprocess
from pathlib import Path

import pytest

from palaestra.api.reasons import Reason
from tests.contract.test_docs import PAGES, ROOT
from tests.pages import anchors, chapters, links

DOCS = ROOT / "docs"
ENTRY = DOCS / "README.md"
RECORDS = set(DOCS.glob("decisions/0*.md"))  # decision records have a different form
FIRST = re.compile(
    r"# [^\n]+\n\n(This page is for [^\n]+\. (?:At its end you (?:have|can|know) |Look up )[^\n]+\.)\n"
)
ADDRESS = re.compile(r"docs/[\w./-]+\.md(?:#[\w-]+)?")
DOORS = ("Train on my laptop", "My own task, robot or world", "Run in a cluster", "Operate a cluster")
TROUBLE = (DOCS / "howto/troubleshooting.md").read_text()


def named(page):
    """Return the pages to which a page links."""
    return {(page.parent / link.partition("#")[0]).resolve() for link in links(page.read_text())}


def missing(page, target):
    """Return whether the file or the heading of a link is missing."""
    path, _, anchor = target.partition("#")
    file = (page.parent / path).resolve() if path else page
    return not file.exists() or bool(anchor and anchor not in anchors(file.read_text()))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_to_a_file_and_every_anchor_to_a_heading(page):
    """After a page is renamed or split, its readers must still find the text."""
    assert [target for target in links(page.read_text()) if missing(page, target)] == []


def test_every_address_outside_the_pages_leads_to_a_page_and_its_heading():
    """Messages, alerts, fields and docstrings name pages.

    Only records of an old release may name old pages.
    """
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    texts = {
        name: (ROOT / name).read_text()
        for name in listed.split()
        if Path(name).suffix in {".py", ".yaml", ".toml", ".sh", ".md", ".tpl", ".txt"}
        and not name.startswith("tests/fixtures/")
        and (ROOT / name).is_file()
    }

    found = {(name, address) for name, text in texts.items() for address in ADDRESS.findall(text)}

    assert len(found) > 50
    assert sorted((name, address) for name, address in found if missing(ROOT / "x", address)) == []


def test_every_page_is_reached_from_the_entry():
    """A reader who starts at docs/README.md must find every page."""
    reached, front = set(), {ENTRY}
    while front:
        reached |= front
        front = {
            page for at in front for page in named(at) if page.suffix == ".md" and page.is_file()
        } - reached
        front = {page for page in front if DOCS in page.parents}

    assert set(DOCS.glob("**/*.md")) - reached == set()


LLMS = ROOT / "llms.txt"


def test_the_list_for_language_models_has_every_page_and_leads_nowhere_else():
    """A program that reads only llms.txt must find every page. https://llmstxt.org defines the format."""
    text = LLMS.read_text()
    listed = {target for _, target in re.findall(r"^- \[(.+?)\]\((.+?)\): .+\.$", text, re.MULTILINE)}

    assert re.match(r"# Palaestra\n\n(> .+\n)+\n", text)
    assert [heading for heading, _ in chapters(text)][1:5] == list(DOORS)
    assert len(listed) == text.count("\n- ")
    assert [target for target in listed if missing(LLMS, target)] == []
    pages = {str(page.relative_to(ROOT)) for page in set(DOCS.glob("**/*.md")) - RECORDS - {ENTRY}}
    assert pages - listed == set()


@pytest.mark.parametrize("door", DOORS)
def test_a_door_leads_along_three_to_five_pages(door):
    """A new reader wants a short path in reading order, not a list of all pages."""
    text = dict(chapters(ENTRY.read_text()))[door]

    assert re.findall(r"^(\d)\. \[.+\]\(.+\): .+\.$", text, re.MULTILINE) == [
        str(n + 1) for n in range(text.count("]("))
    ]
    assert 3 <= text.count("](") <= 5


@pytest.mark.parametrize(
    "page",
    sorted({*DOCS.glob("**/*.md")} - RECORDS),
    ids=lambda page: str(page.relative_to(DOCS)),
)
def test_a_page_begins_with_whom_it_is_for_and_what_they_take_away(page):
    """From the first line a reader decides whether to read the page."""
    assert FIRST.match(page.read_text())


def test_the_list_of_decisions_has_them_all_with_their_titles():
    """Contributors read the list, and would discuss a missing decision again."""
    page = (DOCS / "decisions/README.md").read_text()
    titles = {path.name: re.sub(r"^# \d+[.:] ", "", path.read_text().partition("\n")[0]) for path in RECORDS}

    assert re.findall(r"^\| \[\d{4}\]\((.+?)\) \| (.+) \|$", page, re.MULTILINE) == sorted(titles.items())


def quoted():
    """Return Palaestra's messages in the headings of the troubleshooting page about laptops."""
    text = dict(chapters(TROUBLE))["On a laptop"]
    headings = re.findall(r"^### (`+) ?(.+?) ?\1", text, re.MULTILINE)
    return [message for _, message in headings if message not in OF_OTHERS]


OF_OTHERS = {"palaestra: command not found", "exit code 2"}
SOURCES = [
    ROOT / "tools/setup.sh",
    ROOT / "tools/test-packages.sh",
    *(path for name in ("operator", "trainer", "sim_image") for path in (ROOT / name / "src").rglob("*.py")),
]


@pytest.mark.parametrize("message", quoted())
def test_a_message_that_troubleshooting_explains_is_printed_by_a_program(message):
    """People search for the message that they see. In the headings, `…` stands for names and numbers."""
    text = "\n".join(path.read_text() for path in SOURCES)
    joined = re.sub(r'"\s*f?"', "", text)  # long messages consist of several literals
    words = re.split(r"…|\(ModuleNotFoundError: No module named|Address already in use", message)

    assert [part for part in words if part.strip(" :;).`") and part.strip(" :;).") not in joined] == []


def test_troubleshooting_names_only_reasons_that_there_are():
    """Users search the page for a reason that they see in a status, so an old name would not help."""
    rows = re.findall(r"^\| (`[A-Z]\w+`(?:, `[A-Z]\w+`)*) \|", TROUBLE, re.MULTILINE)
    reasons = {reason for row in rows for reason in re.findall(r"\w+", row)}

    assert len(reasons) > 8
    assert reasons <= {str(reason) for reason in Reason}
