"""The fenced blocks of a page of the documentation, which tests run as written."""

import re

FENCED = re.compile(r"^```([^\n]+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def fenced(page: str) -> list[tuple[str, str]]:
    """Return the info string (e.g. `sh`) and the content of every fenced block of a page."""
    return FENCED.findall(page)


def chapters(page: str) -> list[tuple[str, str]]:
    """Return heading and text of every chapter of a page, up to the next heading of the same level."""
    _, *found = re.split(r"^## ", page, flags=re.MULTILINE)
    return [(heading, text) for heading, _, text in (each.partition("\n") for each in found)]


def blocks(page: str, kind: str) -> list[str]:
    """Return the content of every fenced block whose info string equals `kind`."""
    return [text for found, text in fenced(page) if found == kind]


def links(page: str) -> list[str]:
    """Return, in order, the targets of links and pictures on a page that are paths or anchors."""
    prose = FENCED.sub("", page)
    return re.findall(r"(?:\]\(|src=\")(?!https?:)([^)\s\"]+)", prose)


def anchors(page: str) -> set[str]:
    """Return the anchors of a page's headings, in the spelling of GitHub and GitLab."""
    headings = re.findall(r"^#{1,6} (.*)$", FENCED.sub("", page), re.MULTILINE)
    texts = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading) for heading in headings)
    return {re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-") for text in texts}
