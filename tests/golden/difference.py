"""The difference between two plans, for a person to read.

It is a unified diff whose hunks are headed by a place in an object, not by line numbers. So a line that is
added to every plan changes only the plans that are recorded whole, and no difference.
"""

import re
from collections import Counter
from collections.abc import Iterator
from difflib import SequenceMatcher
from typing import NamedTuple

CONTEXT = 1  # lines around a change; the head of a hunk names the place of the change

Change = tuple[str, int, int, int, int]  # as difflib's: a tag, then the lines before and now


class Line(NamedTuple):
    """A line of a plan, and its place: the kind of its object, then the names of the fields around it.

    Lines of different places are never equal. Containers have the same fields, so difflib would otherwise
    match the end of one container with the end of another.
    """

    place: str
    text: str


def difference(before: str, now: str) -> Iterator[str]:
    """Yield the hunks of the diff from one plan to another, each with the place of its first change."""
    old, new = lines_of(before), lines_of(now)
    # autojunk would ignore lines that a plan has often.
    changes = SequenceMatcher(None, old, new, autojunk=False)
    for hunk in changes.get_grouped_opcodes(CONTEXT):
        yield "".join(f"{line}\n" for line in (f"@@ {_place(hunk, old, new)} @@", *_signed(hunk, old, new)))


def lines_of(plan: str) -> list[Line]:
    """Return the lines of a plan in YAML with their places; a second object of a kind is `<kind> 2`."""
    seen: Counter[str] = Counter()
    lines: list[Line] = []
    for document in re.split(r"(?m)^---\n", plan):
        texts = document.splitlines()
        kind = next((text.removeprefix("kind: ") for text in texts if text.startswith("kind: ")), "object")
        seen[kind] += 1
        lines += _placed(texts, kind if seen[kind] == 1 else f"{kind} {seen[kind]}")
    return lines


def _placed(texts: list[str], root: str) -> Iterator[Line]:
    """Yield the lines of an object below `root`; a line lies in those before it that are indented less.

    An item of a list may be indented as its key is, and lies in it.
    """
    around: list[tuple[tuple[int, bool], str]] = []
    for text in texts:
        content = text.lstrip()
        depth = (len(text) - len(content), content.startswith("- "))
        while content and around and around[-1][0] >= depth:
            around.pop()
        yield Line(" ".join((root, ".".join(name for _, name in around))).rstrip(), text)
        if content:
            around.append((depth, _name(content)))


def _name(content: str) -> str:
    """Return the name of a line in the places of the lines below it: its key; of a list's item, a value."""
    key, _, value = content.removeprefix("- ").partition(":")
    return value.strip() or key if content.startswith("- ") else key


def _place(hunk: list[Change], old: list[Line], new: list[Line]) -> str:
    """Return the place of the first line that a hunk changes."""
    _, old_start, _, new_start, new_end = next(change for change in hunk if change[0] != "equal")
    return new[new_start].place if new_end > new_start else old[old_start].place


def _signed(hunk: list[Change], old: list[Line], new: list[Line]) -> Iterator[str]:
    """Yield the lines of a hunk: the lines that are gone, the new ones, and the context."""
    for tag, old_start, old_end, new_start, new_end in hunk:
        if tag == "equal":
            yield from (f" {line.text}" for line in old[old_start:old_end])
        else:
            yield from (f"-{line.text}" for line in old[old_start:old_end])
            yield from (f"+{line.text}" for line in new[new_start:new_end])
