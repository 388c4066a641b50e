"""Expand the template of a PROTO file for the values of an instance.

    %< const long = fields.height.value > 1; >%
    Solid {
      name %<= '"' + fields.label.value + ' lid"' >%
      %< if (long) { >%  children [ Lid { } ]  %< } else { >%  children [ ]  %< } >%
    }

Webots runs a template as a program in JavaScript or Lua. This module runs only JavaScript without loops and
functions: declarations, assignments, `if` and `else`, and outputs of expressions (`template_code.py`). Any
other template raises TemplateError; the error text is the unsupported code or the problem. The expanded file
keeps the line numbers of the template.
"""

import re
from collections import ChainMap
from collections.abc import Callable, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Final, TypeAlias

from palaestra_sim.world.template_code import (
    MAX_DEPTH,
    CodeTokens,
    Computed,
    Result,
    TemplateError,
    cut,
    text,
    truth,
)

_PIECE: Final = re.compile(
    rb"""%<(?P<out>=?)(?P<code>.*?)>% | (?P<other>%[<{]) | \#[^\n]*
    | " (?: [^"\\\n%] | \\[^\n] | %(?![<{]) )* "?""",
    re.VERBOSE | re.DOTALL,
)
_TEXT: Final = "\0"  # begins the token that stands for a part of the file, or for an output
_WORDS: Final = ("let", "const", "var")
_MAX_CODE: Final = 100_000  # bytes of code in a file

_Names: TypeAlias = ChainMap[str, Result]
"""The values of names: the first mapping is the innermost block, the last one is the whole template."""
_Write: TypeAlias = Callable[[bytes], object]
_Step: TypeAlias = Callable[[_Names | None, _Write], None]
"""Runs a statement; without names, it is in a branch that is not taken, and writes only line ends."""


def first_piece(data: bytes) -> tuple[int, int] | None:
    """Return the offset of the first code in a file, and of the string around it; None without a template."""
    before = None
    for match in _PIECE.finditer(data):
        start = match.start()
        if match.group()[:1] == b"%":
            inside = before is not None and before.end() == start and before.group()[:1] == b'"'
            return start, before.start() if inside and before is not None else start
        before = match
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Template:
    """A parsed template.

    `fields` are the fields whose values its code uses; `start` is the offset of its first code.
    """

    fields: frozenset[str]
    start: int
    _steps: tuple[_Step, ...]

    def expanded(self, values: Mapping[str, Result]) -> bytes:
        """Return the file for these values of its fields.

        Raises:
            TemplateError: a value is missing, or has another type than the code needs.
        """
        written: list[bytes] = []
        names: _Names = ChainMap({f"fields.{name}": value for name, value in values.items()})
        for step in self._steps:
            step(names, written.append)
        return b"".join(written)


def parse_template(data: bytes, start: int) -> Template:
    """Return the template of a file; the first code of the file is at the offset `start`.

    Raises:
        TemplateError: the template has code that this module does not expand.
    """
    fields: set[str] = set()
    parts: list[bytes | Computed] = []
    steps = tuple(_Reader(_tokens(data, parts, fields), fields, parts).steps())
    return Template(fields=frozenset(fields), start=start, _steps=steps)


def _tokens(data: bytes, parts: list[bytes | Computed], fields: set[str]) -> list[str]:
    """Return the tokens of all code; each text and each output is one token, and is added to `parts`."""
    tokens: list[str] = []
    at = size = 0
    for match in _PIECE.finditer(data):
        if match["other"]:
            raise TemplateError(match["other"].decode())
        if match["code"] is None:
            continue
        size += len(match["code"])
        if size > _MAX_CODE:
            raise TemplateError(f"more than {_MAX_CODE} bytes of code")
        tokens.append(_part(parts, data[at : match.start()]))
        at = match.end()
        code = cut(match["code"].decode())
        if match["out"]:
            inner = CodeTokens(code, fields)
            tokens.append(_part(parts, inner.expression()))
            inner.expect("")
        else:
            tokens += code
        tokens.append(_part(parts, b"\n" * match["code"].count(b"\n")))
    return [*tokens, _part(parts, data[at:])]


def _part(parts: list[bytes | Computed], part: bytes | Computed) -> str:
    """Add a part; return its token."""
    parts.append(part)
    return f"{_TEXT}{len(parts) - 1}"


class _Reader(CodeTokens):
    """The rules of statements."""

    def __init__(self, tokens: list[str], fields: set[str], parts: list[bytes | Computed]) -> None:
        super().__init__(tokens, fields)
        self._parts = parts
        self._blocks = 0

    def steps(self, end: str = "") -> list[_Step]:
        """Read `statement*` up to the token `end`."""
        found = []
        while self.peek() != end:
            if not self.peek():
                raise TemplateError("a { that is never closed")
            found.append(self._statement())
        self.take()
        return found

    def _statement(self) -> _Step:
        """Read `statement := part | if | word? name "=" expression ";"?`."""
        token = self.take()
        if token.startswith(_TEXT):
            return _written(self._parts[int(token[1:])])
        if token == "if":
            return self._if()
        word = token if token in _WORDS else ""
        name = self.take() if word else token
        if not name.isidentifier():
            raise TemplateError(f"{token} {name}" if name != token else token)
        if not self.skip("="):
            raise TemplateError(f"{name} {self.peek()}".strip())
        value = self.expression()
        self.skip(";")
        return _assigned(word, name, value)

    def _if(self) -> _Step:
        """Read `if := "(" expression ")" "{" statement* "}" ("else" ("if" if | "{" statement* "}"))?`."""
        self._blocks += 1
        if self._blocks > MAX_DEPTH:
            raise TemplateError("too many levels")
        self.expect("(")
        condition = self.expression()
        self.expect(")")
        self.expect("{")
        yes, no = self.steps("}"), self._else()
        self._blocks -= 1
        return _chosen(condition, yes, no)

    def _else(self) -> list[_Step]:
        if not self.skip("else"):
            return []
        if self.skip("if"):
            return [self._if()]
        self.expect("{")
        return self.steps("}")


def _written(part: bytes | Computed) -> _Step:
    """Return the statement that writes a text of the file, or the value of an output."""

    def step(names: _Names | None, write: _Write) -> None:
        if isinstance(part, bytes):
            write(b"\n" * part.count(b"\n") if names is None else part)
        elif names is not None:
            write(text(part(names)).encode())

    return step


def _assigned(word: str, name: str, value: Computed) -> _Step:
    """Return the statement that gives a name a value; `word` is "" if the statement declares no name."""

    def step(names: _Names | None, write: _Write) -> None:
        del write
        if names is not None:
            _scope(word, name, names)[name] = value(names)

    return step


def _scope(word: str, name: str, names: _Names) -> MutableMapping[str, Result]:
    """Return the block in which a statement sets a name, by the rules of JavaScript."""
    whole = names.maps[-1]
    if word:
        return whole if word == "var" else names.maps[0]
    return next((scope for scope in names.maps if name in scope), whole)


def _chosen(condition: Computed, yes: list[_Step], no: list[_Step]) -> _Step:
    """Return the statement that runs one of two blocks."""

    def step(names: _Names | None, write: _Write) -> None:
        holds = names is not None and truth(condition(names))
        block = None if names is None else names.new_child()
        for inner in yes:
            inner(block if holds else None, write)
        for inner in no:
            inner(None if holds else block, write)

    return step
