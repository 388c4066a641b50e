"""Formulas in a file of stand-ins: lengths that depend on the fields of an object.

    0.74   size.x   size.z - frameThickness / 2   0.5 * (size.x + 0.1)   sum(rowsHeights)

A name is a field with one number (TRUE counts as 1, FALSE as 0); `.x`, `.y` and `.z` select the numbers of a
vector; `sum` adds all numbers of a field. The language has nothing else, so a file of stand-ins cannot
contain code.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

MAX_LENGTH = 200
"""Maximum length of a formula in characters, which also limits its nesting."""

_TOKEN = re.compile(r"\s*(?:(?P<number>\d+\.?\d*)|(?P<name>[A-Za-z_]\w*(?:\.[xyz])?)|(?P<mark>[-+*/()]))")

Numbers: TypeAlias = Callable[[str], Sequence[float]]
"""Returns the numbers of a field."""

_Tree: TypeAlias = "float | str | _Operation"


class _Operation(NamedTuple):
    """`left mark right`, where the mark is one of + - * and /."""

    mark: str
    left: _Tree
    right: _Tree


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed formula; `names` are the fields in it, with `.x` or `sum()` as in the formula."""

    text: str
    tree: _Tree

    @property
    def names(self) -> tuple[str, ...]:
        """Return the fields of the formula as it uses them: `size.x`, `height`, `sum(rowsHeights)`."""
        return tuple(_names(self.tree))

    def value(self, numbers: Numbers) -> float:
        """Return the value for the `numbers` of an object; a division by zero gives 0."""
        return _value(self.tree, numbers)


def parse_formula(written: object) -> Expression:
    """Return the formula of a number or a text.

    Raises:
        ValueError: `written` is not a number or a formula; the message has the fact and the remedy.
    """
    if isinstance(written, int | float) and not isinstance(written, bool):
        return Expression(str(written), float(written))
    if not isinstance(written, str):
        fact = f"{written!r} is not a length"
        raise ValueError(f"{fact}; write a number, the name of a field, or a formula")  # noqa: TRY004 - it is in a file
    if len(written) > MAX_LENGTH:
        raise ValueError(f"a formula has more than {MAX_LENGTH} characters; shorten it")
    return Expression(written, _Reader(written).formula())


class _Reader:
    """Recursive descent over the tokens of a formula."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = self._cut()
        self._at = 0

    def formula(self) -> _Tree:
        """Read `formula := sum`, and nothing after it."""
        tree = self._sum()
        if self._peek():
            raise self._error()
        return tree

    def _cut(self) -> list[str]:
        tokens, at = [], 0
        text = self._text.rstrip()
        while at < len(text):
            match = _TOKEN.match(text, at)
            if match is None:
                raise ValueError(
                    f"{text[at:].strip()!r} in {self._text!r} is not part of a formula; {_REMEDY}"
                )
            tokens.append(match.group().strip())
            at = match.end()
        return tokens

    def _sum(self) -> _Tree:
        """Read `sum := product (("+" | "-") product)*`."""
        tree = self._product()
        while self._peek() in ("+", "-"):
            tree = _Operation(self._take(), tree, self._product())
        return tree

    def _product(self) -> _Tree:
        """Read `product := atom (("*" | "/") atom)*`."""
        tree = self._atom()
        while self._peek() in ("*", "/"):
            tree = _Operation(self._take(), tree, self._atom())
        return tree

    def _atom(self) -> _Tree:
        """Read `atom := number | "-" atom | "(" sum ")" | "sum" "(" name ")" | name`."""
        token = self._take()
        if token == "-":
            return _Operation("-", 0.0, self._atom())
        if token == "(":
            tree = self._sum()
            self._close()
            return tree
        if token == "sum" and self._peek() == "(":
            self._take()
            name = self._take()
            self._close()
            return f"sum({name})"
        if token[:1].isdigit():
            return float(token)
        if token[:1].isalpha() or token[:1] == "_":
            return token
        raise self._error()

    def _close(self) -> None:
        if self._take() != ")":
            raise self._error()

    def _peek(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self) -> str:
        token = self._peek()
        self._at += 1
        return token

    def _error(self) -> ValueError:
        return ValueError(f"{self._text!r} is not a formula; {_REMEDY}")


_REMEDY = "write numbers and fields with + - * / ( ), such as size.x / 2"


def _names(tree: _Tree) -> list[str]:
    if isinstance(tree, str):
        return [tree]
    if isinstance(tree, _Operation):
        return _names(tree.left) + _names(tree.right)
    return []


def _value(tree: _Tree, numbers: Numbers) -> float:
    if isinstance(tree, _Operation):
        return _result(tree.mark, _value(tree.left, numbers), _value(tree.right, numbers))
    return _named(tree, numbers) if isinstance(tree, str) else tree


def _result(mark: str, left: float, right: float) -> float:
    match mark:
        case "+":
            return left + right
        case "-":
            return left - right
        case "*":
            return left * right
        case _:
            return left / right if right else 0.0


def _named(name: str, numbers: Numbers) -> float:
    if name.startswith("sum("):
        return sum(numbers(name[4:-1]))
    field, _, axis = name.partition(".")
    return numbers(field)["xyz".index(axis) if axis else 0]
