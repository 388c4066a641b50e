r"""Cut a world file into tokens, each with its offset in the bytes.

No token has the gaps between tokens (blanks, line ends, commas and comments); the editor of a world copies
them from the bytes. Only this module reads and writes strings. They have the escapes `\"` and `\\`; every
other backslash stands for itself.
"""

import re
from typing import Literal, NamedTuple, cast

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
_NUMBER = re.compile(rb"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_ESCAPE = re.compile(r'\\(["\\])')


class Token(NamedTuple):
    """One token: its kind, its bytes as written, and their offset."""

    kind: Kind
    text: bytes
    start: int
    end: int


def tokenize(source: Source) -> tuple[Token, ...]:
    """Return the tokens of a world in order, closed by an empty one of kind `end`.

    Raises:
        WorldError: a string is never closed, a number is malformed, or a character is not allowed.
    """
    tokens = []
    for match in _TOKEN.finditer(source.data, source.begin):
        kind = match.lastgroup
        if kind == "gap":
            continue
        if kind == "stray" or (kind == "number" and not _NUMBER.fullmatch(match.group())):
            raise _misfit(source, match)
        tokens.append(Token(cast("Kind", kind), match.group(), match.start(), match.end()))
    tokens.append(Token("end", b"", len(source.data), len(source.data)))
    return tuple(tokens)


def quoted(text: str) -> bytes:
    """Return `text` as a string of a world file, with its quotes."""
    return b'"' + text.replace("\\", "\\\\").replace('"', '\\"').encode() + b'"'


def unquoted(token: Token) -> str:
    """Return the text that a token of kind `string` stands for."""
    return _ESCAPE.sub(r"\1", token.text[1:-1].decode())


def _misfit(source: Source, match: re.Match[bytes]) -> Exception:
    """Return the error for text that fits no kind of token."""
    text = match.group()
    if text == b'"':
        fact = "this string is not closed on its line"
        return source.error(match.start(), fact, 'add the missing "')
    if match.lastgroup == "number":
        fact = f"{text.decode()} is neither a number nor a name"
        return source.error(match.start(), fact, "a name begins with a letter")
    fact = f"control character 0x{text[0]:02x} outside a string"
    return source.error(match.start(), fact, "remove it")
