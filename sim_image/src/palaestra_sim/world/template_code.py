"""Parse and compute expressions in the code of a PROTO's template.

The language is the part of JavaScript without side effects: numbers, strings, `true` and `false`, names,
`fields.size.value`, `fields.size.value.x`, the operators `+ - * / == != === !== < <= > >= && || !`, and
`a ? b : c`. It has no loops, functions and arrays, so a template of an untrusted author always ends.
"""

import operator
import re
from collections.abc import Callable, Mapping
from typing import Final, TypeAlias

MAX_TEXT: Final = 10_000  # characters of a computed string
MAX_DEPTH: Final = 40  # levels of parentheses, operators and blocks
MAX_WHOLE: Final = 1e21  # JavaScript writes whole numbers up to this one without an exponent

Result: TypeAlias = float | bool | str | dict[str, float]
Names: TypeAlias = Mapping[str, Result]
"""The values of names, and of fields as `fields.NAME`."""
Computed: TypeAlias = Callable[[Names], Result]
"""A parsed expression: it returns its value for the values of names."""

_TOKEN: Final = re.compile(
    r"""(?:(?P<number>\d+\.?\d*(?:[eE][-+]?\d+)?) | (?P<string>'[^'\\\n]*'|"[^"\\\n]*")
    | (?P<name>[A-Za-z_]\w*(?:\.\w+)*) | (?P<mark>===|!==|==|!=|<=|>=|&&|\|\||[-+*/<>!?:()={};]))""",
    re.VERBOSE,
)
_GAP: Final = re.compile(r"(?:\s|//[^\n]*|/\*.*?\*/)*", re.DOTALL)  # spaces and comments; it matches always
_FIELD: Final = re.compile(r"fields\.(\w+)\.value(?:\.([xyzargb]))?")
_COMPARED: Final[dict[str, Callable[[float, float], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_LEVELS: Final = (("||",), ("&&",), ("===", "!==", "==", "!="), tuple(_COMPARED), ("+", "-"), ("*", "/"))


class TemplateError(ValueError):
    """A template has code that this module does not support; the error text is the code or the problem."""


def cut(code: str) -> list[str]:
    """Return the tokens of code, without comments."""
    tokens: list[str] = []
    at = _end_of_gap(code, 0)
    while at < len(code):
        match = _TOKEN.match(code, at)
        if match is None:
            raise TemplateError(code[at:].split("\n", maxsplit=1)[0].strip())
        tokens.append(match.group())
        at = _end_of_gap(code, match.end())
    return tokens


def _end_of_gap(code: str, start: int) -> int:
    """Return the offset of the next token. A comment can begin only between tokens, never in a string."""
    gap = _GAP.match(code, start)
    return start if gap is None else gap.end()


class CodeTokens:
    """A position in a list of tokens, and the rules of expressions."""

    def __init__(self, tokens: list[str], fields: set[str]) -> None:
        self._tokens = tokens
        self._at = 0
        self._depth = 0
        self._fields = fields  # receives the name of every field in an expression

    def peek(self) -> str:
        """Return the next token, "" at the end."""
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def take(self) -> str:
        """Return the next token and move past it."""
        token = self.peek()
        self._at += 1
        return token

    def skip(self, token: str) -> bool:
        """Move past the next token if it is `token`; return whether it was."""
        if self.peek() != token:
            return False
        self._at += 1
        return True

    def expect(self, token: str) -> None:
        """Move past `token`, which must be next."""
        if not self.skip(token):
            raise TemplateError(self.peek() or "an end without " + token)

    def expression(self) -> Computed:
        """Read `expression := level ("?" expression ":" expression)?`."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise TemplateError("too many levels")
        condition = self._level(0)
        if self.skip("?"):
            yes = self.expression()
            self.expect(":")
            no = self.expression()
            self._depth -= 1
            return lambda names: yes(names) if truth(condition(names)) else no(names)
        self._depth -= 1
        return condition

    def _level(self, level: int) -> Computed:
        """Read operands and the operators of a level, from the weakest operators to the strongest."""
        if level == len(_LEVELS):
            return self._operand()
        left = self._level(level + 1)
        for _ in range(MAX_DEPTH):
            if self.peek() not in _LEVELS[level]:
                return left
            left = _joined(self.take(), left, self._level(level + 1))
        raise TemplateError("too many levels")

    def _operand(self) -> Computed:
        """Read `operand := ("!" | "-") operand | "(" expression ")" | number | string | name`."""
        token = self.take()
        if token in ("!", "-", "("):
            inner = self.expression() if token == "(" else self._inner()
            if token == "(":
                self.expect(")")
                return inner
            return (lambda names: not truth(inner(names))) if token == "!" else lambda n: -number(inner(n))
        if token[:1] in ("'", '"'):
            return lambda _: token[1:-1]
        if token[:1].isdigit():
            return lambda _: float(token)
        return self._name(token)

    def _inner(self) -> Computed:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise TemplateError("too many levels")
        inner = self._operand()
        self._depth -= 1
        return inner

    def _name(self, token: str) -> Computed:
        """Return the value of a constant, of a field or of a declared name."""
        if token in ("true", "false"):
            return lambda _: token == "true"
        field = _FIELD.fullmatch(token)
        if field is not None:
            name, axis = field.groups()
            self._fields.add(name)
            return lambda names: _axis(_found(names, f"fields.{name}", token), axis, token)
        if not token.isidentifier() or self.peek() == "(":
            raise TemplateError(token or "an end without a value")
        return lambda names: _found(names, token, token)


def truth(value: Result) -> bool:
    """Return whether JavaScript treats a value as true."""
    return bool(value)


def number(value: Result) -> float:
    """Return a number; refuse every other value."""
    if isinstance(value, float):
        return value
    raise TemplateError(f"{value!r} instead of a number")


def text(value: Result) -> str:
    """Return a value as JavaScript writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < MAX_WHOLE else repr(value)
    if isinstance(value, str):
        return value
    raise TemplateError("a vector instead of a text")


def _found(names: Names, name: str, written: str) -> Result:
    if name not in names:
        raise TemplateError(written)
    return names[name]


def _axis(value: Result, axis: str | None, written: str) -> Result:
    """Return a value; if `axis` is given, return the number of a vector along this axis."""
    if axis is None:
        return value
    if not isinstance(value, dict) or axis not in value:
        raise TemplateError(written)
    return value[axis]


def _joined(mark: str, left: Computed, right: Computed) -> Computed:
    """Return the expression `left mark right`."""
    if mark == "&&":
        return lambda names: right(names) if truth(first := left(names)) else first
    if mark == "||":
        return lambda names: first if truth(first := left(names)) else right(names)
    return lambda names: _applied(mark, left(names), right(names))


def _applied(mark: str, left: Result, right: Result) -> Result:
    """Return the value of an operator for two values."""
    if mark in ("==", "!=", "===", "!=="):
        if type(left) is not type(right) and mark in ("==", "!="):  # JavaScript would convert a value
            raise TemplateError(f"{left!r} {mark} {right!r}")
        return (type(left) is type(right) and left == right) == mark.startswith("=")
    if mark == "+" and str in (type(left), type(right)):
        whole = text(left) + text(right)
        if len(whole) > MAX_TEXT:
            raise TemplateError(f"a text of more than {MAX_TEXT} characters")
        return whole
    if mark in _COMPARED:
        return _COMPARED[mark](number(left), number(right))
    return _computed(mark, number(left), number(right))


def _computed(mark: str, left: float, right: float) -> float:
    match mark:
        case "+":
            return left + right
        case "-":
            return left - right
        case "*":
            return left * right
        case _:
            if right == 0.0:
                raise TemplateError("a division by zero")
            return left / right
