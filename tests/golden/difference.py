"""The difference between two plans, in a form that a person can read.

The result is a unified diff. The head of a hunk names a place in an object instead of line numbers. So if
every plan gets a new line, only the two plans that are recorded whole change, and the recorded differences do
not.
"""

import re
from collections import Counter
from collections.abc import Iterator
from difflib import SequenceMatcher
from typing import NamedTuple

CONTEXT = 1  # lines before and after a change

Change = tuple[str, int, int, int, int]  # difflib's format: a tag, and the range of lines before and after


class Line(NamedTuple):
    """A line of a plan, and its place: the kind of its object, and the names of the fields around the line.

    Lines with different places are never equal. Otherwise difflib would match the end of one container with
    the end of another, because all containers have the same fields.
    """

    place: str
    text: str


def difference(before: str, now: str) -> Iterator[str]:
    """Yield the hunks of the diff between two plans; the head names the place of the first change."""
    old, new = lines_of(before), lines_of(now)
    # With autojunk, difflib would ignore lines that occur often in a plan.
    changes = SequenceMatcher(None, old, new, autojunk=False)
    for hunk in changes.get_grouped_opcodes(CONTEXT):
        yield "".join(f"{line}\n" for line in (f"@@ {_place(hunk, old, new)} @@", *_signed(hunk, old, new)))


def lines_of(plan: str) -> list[Line]:
    """Return the lines of a plan in YAML with their places; the second object of a kind is `<kind> 2`."""
    seen: Counter[str] = Counter()
    lines: list[Line] = []
    for document in re.split(r"(?m)^---\n", plan):
        texts = document.splitlines()
        kind = next((text.removeprefix("kind: ") for text in texts if text.startswith("kind: ")), "object")
        seen[kind] += 1
        lines += _placed(texts, kind if seen[kind] == 1 else f"{kind} {seen[kind]}")
    return lines


def _placed(texts: list[str], root: str) -> Iterator[Line]:
    """Yield the lines of an object; `root` is the first part of their places.

    The other parts are the earlier lines with less indentation. A list's item may have the indentation of the
    list's key, and is inside it.
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
    """Return the name that a line adds to the places below it: a key, or a value for an item of a list."""
    key, _, value = content.removeprefix("- ").partition(":")
    return value.strip() or key if content.startswith("- ") else key


def _place(hunk: list[Change], old: list[Line], new: list[Line]) -> str:
    """Return the place of the first line that a hunk changes."""
    _, old_start, _, new_start, new_end = next(change for change in hunk if change[0] != "equal")
    return new[new_start].place if new_end > new_start else old[old_start].place


def _signed(hunk: list[Change], old: list[Line], new: list[Line]) -> Iterator[str]:
    """Yield the lines of a hunk with their signs: removed lines, added lines, and context."""
    for tag, old_start, old_end, new_start, new_end in hunk:
        if tag == "equal":
            yield from (f" {line.text}" for line in old[old_start:old_end])
        else:
            yield from (f"-{line.text}" for line in old[old_start:old_end])
            yield from (f"+{line.text}" for line in new[new_start:new_end])
