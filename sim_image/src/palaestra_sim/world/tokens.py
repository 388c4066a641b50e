r"""Split a world file into tokens, each with its offset in the bytes.

The gaps between tokens (blanks, line ends, commas and comments) are not tokens; `patches` copies them
unchanged. Only this module reads and writes strings. A string has the escapes `\"` and `\\`; every other
backslash is an ordinary character.
"""

import re
from array import array
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import Final, Literal, NamedTuple, overload

from palaestra_sim.world.source import Source

Kind = Literal["string", "number", "word", "mark", "end"]

_TOKEN = re.compile(
    rb"""
      (?P<gap>    (?: [ \t\r\n,]++ | \#[^\n]*+ )++ )
    | (?P<string> " (?: [^"\\\n]++ | \\[^\n] )*+ " )
    | (?P<mark>   [][{}] )
    | (?P<number> [+\-.0-9] [^\x00-\x20,\#\[\]{}]*+ )
    | (?P<word>   [^\x00-\x20",\#\[\]{}] [^\x00-\x20,\#\[\]{}]*+ )
    | (?P<stray>  . )
    """,
    re.VERBOSE | re.DOTALL,
)
# The quantifiers are possessive, because otherwise a long number before a letter would take quadratic time.
_NUMBER = re.compile(rb"[+-]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)(?:[eE][+-]?[0-9]++)?")
GLANCE = 40  # maximum length of a text of the file in an error message
_ESCAPE = re.compile(r'\\(["\\])')


class Token(NamedTuple):
    """One token: its kind, its bytes as written, and their offset."""

    kind: Kind
    text: bytes
    start: int
    end: int


_KINDS: Final[tuple[Kind, ...]] = ("string", "number", "word", "mark", "end")
_PLACE_OF: Final[dict[str, int]] = {kind: place for place, kind in enumerate(_KINDS)}


class Tokens(Sequence[Token]):
    """The tokens of a file, stored as kinds and offsets: nine bytes for each token.

    A `Token` is created on access. All tokens at once would take 150 MB for a file of 1 MB.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._kinds = bytearray()
        self._starts = array("I")  # 32 bits are enough, because no file has 4 GiB
        self._ends = array("I")

    def append(self, kind: str, start: int, end: int) -> None:
        """Add the next token."""
        self._kinds.append(_PLACE_OF[kind])
        self._starts.append(start)
        self._ends.append(end)

    def index_at(self, offset: int, first: int = 0) -> int:
        """Return the index, at least `first`, of the token at byte `offset` or of the next token."""
        return bisect_left(self._starts, offset, lo=first)

    def __len__(self) -> int:
        """Return the number of tokens, including the token of kind `end`."""
        return len(self._kinds)

    @overload
    def __getitem__(self, index: int) -> Token: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Token, ...]: ...

    def __getitem__(self, index: int | slice) -> Token | tuple[Token, ...]:
        """Return a token, or a tuple of tokens for a slice."""
        if isinstance(index, slice):
            return tuple(map(self._token, self._kinds[index], self._starts[index], self._ends[index]))
        return self._token(self._kinds[index], self._starts[index], self._ends[index])

    def __iter__(self) -> Iterator[Token]:
        """Yield the tokens in order."""
        return map(self._token, self._kinds, self._starts, self._ends)

    def _token(self, kind: int, start: int, end: int) -> Token:
        return Token(_KINDS[kind], self._data[start:end], start, end)


def tokenize(source: Source) -> Tokens:
    """Return the tokens of a world in order, followed by an empty token of kind `end`.

    Raises:
        WorldError: a string is never closed, a number is malformed, or a character is not allowed.
    """
    tokens = Tokens(source.data)
    for match in _TOKEN.finditer(source.data, source.begin):
        kind = match.lastgroup
        if kind == "gap" or kind is None:
            continue
        if kind == "stray" or (kind == "number" and not _NUMBER.fullmatch(match.group())):
            raise _misfit(source, match)
        tokens.append(kind, match.start(), match.end())
    tokens.append("end", len(source.data), len(source.data))
    return tokens


def quoted(text: str) -> bytes:
    """Return `text` as a string of a world file, with its quotes."""
    return b'"' + text.replace("\\", "\\\\").replace('"', '\\"').encode() + b'"'


def glance(text: str) -> str:
    """Return a text of a file for an error message, shortened to `GLANCE` characters."""
    return text if len(text) <= GLANCE else text[:GLANCE] + "…"


def unquoted(token: Token) -> str:
    """Return the text of a token of kind `string`, without quotes and escapes."""
    return _ESCAPE.sub(r"\1", token.text[1:-1].decode())


def _misfit(source: Source, match: re.Match[bytes]) -> Exception:
    """Return the error for text that is not a token of any kind."""
    text = match.group()
    if text == b'"':
        fact = "this string is not closed on its line"
        return source.error(match.start(), fact, 'add the missing "')
    if match.lastgroup == "number":
        fact = f"{glance(text.decode())} is neither a number nor a name"
        return source.error(match.start(), fact, "a name begins with a letter")
    fact = f"control character 0x{text[0]:02x} outside a string"
    return source.error(match.start(), fact, "remove it")
