"""Compute the `controllerArgs` of one robot, as edits of as few bytes as possible.

Each string of the list is kept, replaced, or removed; the order does not change. Two forms are corrected,
because their arguments would not reach the controller. A bare string, as in worlds up to R2020a, becomes a
list. A string with several options becomes one string for each option, because Webots passes each string as a
single argument.
"""

import re
from itertools import chain

from palaestra_sim.world.patches import Patch
from palaestra_sim.world.robots import CLOCK, NAME, SYNCHRONIZE
from palaestra_sim.world.tokens import Token, quoted, unquoted
from palaestra_sim.world.tree import Node, Value, World

# Matches all bytes up to the end of the line of the last comment.
_UP_TO_COMMENT = re.compile(rb"\A.*#[^\n]*\n?", re.DOTALL)
_LONGEST_GAP = 200  # the text between two strings is copied only if it has at most this many bytes
_INDENT = re.compile(rb"\r?\n[ \t]*\Z")


def asks_for_clock(robot: Node) -> bool:
    """Return whether a robot's arguments contain `--clock`."""
    return any(CLOCK in _options(text) for text in robot.texts("controllerArgs"))


def argument_edits(world: World, robot: Node, ros_name: str, *, clock: bool) -> tuple[Patch, ...]:
    """Return the edits that give a robot its `--name=` and `--synchronize`.

    If `clock` is True, the first `--clock` stays, and every other `--clock` is removed. The edits never add a
    `--clock`.
    """
    value = robot.fields.get("controllerArgs")
    if value is None:
        return (_new_field(world, robot, ros_name),)
    strings = [token for token in world.inside(value) if token.kind == "string"]
    if not value.bracketed:
        return (_new_list(value, strings[0], ros_name, clock=clock),)
    if not strings:
        start = value.span[0] + 1
        texts = _rows([], ros_name, clock=clock)[0]
        return (Patch(start=start, end=start, text=b" ".join(texts), tokens=texts),)
    rows = _rows(strings, ros_name, clock=clock)
    changed = [pair for pair in zip(strings, rows, strict=True) if pair[1] != (pair[0].text,)]
    gap = _gap_before(world, strings[0])
    separator = b" " if b"#" in gap or not gap or len(gap) > _LONGEST_GAP else gap
    return tuple(_new_row(world, token, row, separator) for token, row in changed)


def _rows(strings: list[Token], ros_name: str, *, clock: bool) -> list[tuple[bytes, ...]]:
    """Return, for each string of a list, the strings that replace it; one row for an empty list.

    A missing name is inserted at the beginning, and a missing `--synchronize` after the name.
    """
    name, synchronize = quoted(NAME + ros_name), quoted(SYNCHRONIZE)
    rows: list[list[bytes]] = []
    named = False
    for string in strings:
        row: list[bytes] = []
        rows.append(row)
        options = _options(unquoted(string))
        for option in options:
            if option.startswith(NAME):
                row += [] if named else [name]
                named = True
            elif option != CLOCK:
                row.append(quoted(option) if len(options) > 1 else string.text)
            elif clock:
                row.append(quoted(CLOCK))
                clock = False
    rows = rows or [[]]
    if name not in chain(*rows):
        rows[0].insert(0, name)
    if synchronize not in chain(*rows):
        row = next(row for row in rows if name in row)
        row.insert(row.index(name) + 1, synchronize)
    return [tuple(row) for row in rows]


def _options(text: str) -> list[str]:
    """Return the options in a string; a string is split only if each word begins with `--`."""
    words = text.split()
    several = len(words) > 1 and all(word.startswith("--") for word in words)
    return words if several else [text]


def _new_row(world: World, token: Token, row: tuple[bytes, ...], separator: bytes) -> Patch:
    """Replace one string of a list; if the row is empty, remove the blanks before the string too."""
    start = token.start
    if not row:
        start -= len(_UP_TO_COMMENT.sub(b"", _gap_before(world, token)))
    return Patch(start=start, end=token.end, text=separator.join(row), tokens=row)


def _new_list(value: Value, string: Token, ros_name: str, *, clock: bool) -> Patch:
    """Replace a bare string by a list; an empty string means no arguments."""
    strings = [string] if unquoted(string) else []
    texts = tuple(chain(*_rows(strings, ros_name, clock=clock)))
    text = b"[" + b" ".join(texts) + b"]"
    return Patch(start=value.span[0], end=value.span[1], text=text, tokens=(b"[", *texts, b"]"))


def _new_field(world: World, robot: Node, ros_name: str) -> Patch:
    """Add `controllerArgs` after `controller`, on separate lines if `controller` has its own line."""
    start, end = robot.fields["controller"].span
    field = world.index(start) - 1
    gap = world.source[world.tokens[field - 1].end : world.tokens[field].start]
    indent = _INDENT.search(gap)
    line = indent.group() if indent else b" "
    inner = line + b"  " if indent else b""
    texts = _rows([], ros_name, clock=False)[0]
    items = (inner or b" ").join(texts)
    text = line + b"controllerArgs [" + inner + items + (line if indent else b"") + b"]"
    return Patch(start=end, end=end, text=text, tokens=(b"controllerArgs", b"[", *texts, b"]"))


def _gap_before(world: World, token: Token) -> bytes:
    """Return the bytes between a token and the previous token: blanks, commas, comments."""
    before = world.tokens[world.index(token.start) - 1]
    return world.source[before.end : token.start]
