"""`llms.txt`, the list of all pages for language models, made from docs/README.md and the pages it links to.

The form is that of https://llmstxt.org: a title, a summary, and sections of links with a note each.
The first sections list the pages of each reading path, in order. The other pages follow by kind. Their notes
are the first lines of the pages, which name the readers.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path

PAGE = "llms.txt"
ENTRY = "docs/README.md"
_HEADER = "Generated from docs/README.md by `make golden`."
_AGENTS = [
    ("Guide for coding agents", "operator/src/palaestra/SKILL.md", "from an empty folder to a trained job."),
    ("Examples", "manifests/examples", "TrainingJobs that learn their task."),
    ("Schema", "manifests/crd.yaml", "every field; `palaestra explain --json` prints it for editors."),
]
_OPTIONAL = [
    ("Changelog", "CHANGELOG.md", "what changed for users."),
    ("Contributing", "CONTRIBUTING.md", "the commands for a change, and which files it touches."),
    ("Security", "SECURITY.md", "the threat model."),
]
_ITEM = re.compile(r"^\d+\. \[(.+?)\]\((.+?)\): (.+)$", re.MULTILINE)
_ROW = re.compile(r"^\| (\[.+?) \| (.+) \|$", re.MULTILINE)
_LINK = re.compile(r"\[(.+?)\]\((.+?)\)")
_FIRST = re.compile(r"# ([^\n]+)\n\nThis page is for ([^\n]+)\n")


def page(root: Path) -> str:
    """Return the text of `llms.txt` for the pages below `root`."""
    readme = (root / "README.md").read_text(encoding="utf-8")
    title, summary = re.match(r"# (.+)\n\n((?:.+\n)+)", readme).groups()  # type: ignore[union-attr]
    quoted = "\n".join(f"> {line}" for line in summary.splitlines())
    sections = _sections(root, (root / ENTRY).read_text(encoding="utf-8"))
    return "\n\n".join((f"# {title}", quoted, _HEADER, *sections)) + "\n"


def _sections(root: Path, entry: str) -> Iterator[str]:
    yield _section("For coding agents", _AGENTS)
    named: set[str] = set()
    for heading, text in re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", entry, re.DOTALL | re.MULTILINE):
        if items := _ITEM.findall(text):
            links = [(name, _from_root(target), note) for name, target, note in items]
            named |= {target for _, target, _ in links}
            yield _section(heading, links)
    for kind, rows in re.findall(r"^\| ([a-z ]+) \| \|\n\|---\|---\|\n((?:\|.+\n)+)", entry, re.MULTILINE):
        links = [link for link in _others(root, rows) if link[1] not in named]
        yield _section(kind.capitalize(), links)
    yield _section("Optional", _OPTIONAL)


def _others(root: Path, rows: str) -> Iterator[tuple[str, str, str]]:
    for cell, note in _ROW.findall(rows):
        for name, target in _LINK.findall(cell):
            path = _from_root(target)
            found = _FIRST.match((root / path).read_text(encoding="utf-8")) if path.endswith(".md") else None
            yield (found[1], path, f"For {found[2]}") if found else (name, path, f"{note}.")


def _section(heading: str, links: list[tuple[str, str, str]]) -> str:
    return "\n".join((f"## {heading}", "", *(f"- [{name}]({path}): {note}" for name, path, note in links)))


def _from_root(target: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(ENTRY), target))
