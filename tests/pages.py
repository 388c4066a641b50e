"""The fenced blocks of a page of the documentation, which tests run as written."""

import re

FENCED = re.compile(r"^```([^\n]+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def fenced(page: str) -> list[tuple[str, str]]:
    """Return every block of a page, as the text after its fence, e.g. `sh`, and its lines."""
    return FENCED.findall(page)


def chapters(page: str) -> list[tuple[str, str]]:
    """Return heading and text of every chapter of a page, up to the next heading of the same level."""
    _, *found = re.split(r"^## ", page, flags=re.MULTILINE)
    return [(heading, text) for heading, _, text in (each.partition("\n") for each in found)]


def blocks(page: str, kind: str) -> list[str]:
    """Return the blocks whose fence has exactly the text `kind`."""
    return [text for found, text in fenced(page) if found == kind]


def links(page: str) -> list[str]:
    """Return the target of every link and picture of a page that is a path or an anchor, in its order."""
    prose = FENCED.sub("", page)
    return re.findall(r"(?:\]\(|src=\")(?!https?:)([^)\s\"]+)", prose)


def anchors(page: str) -> set[str]:
    """Return what may stand behind `#` in a link to a page: its headings, as GitHub and GitLab spell them."""
    headings = re.findall(r"^#{1,6} (.*)$", FENCED.sub("", page), re.MULTILINE)
    texts = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading) for heading in headings)
    return {re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-") for text in texts}
