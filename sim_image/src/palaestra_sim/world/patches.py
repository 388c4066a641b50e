"""Change a few spans of a world and leave every other byte unchanged.

A patch has the bytes to insert, and the tokens that they must form. After the change, the result is split
into tokens again. The result must have the old tokens with exactly those changes. So this module finds an
accidental change of nearby bytes before a simulator reads the world.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, tokenize


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """Replace the bytes from `start` to `end` by `text`, which consists of `tokens`."""

    start: int
    end: int
    text: bytes
    tokens: tuple[bytes, ...]


def edited(source: Source, tokens: Sequence[Token], edits: Sequence[Patch]) -> bytes:
    """Return the bytes of `source`, whose tokens are `tokens`, after the `edits`.

    Edits are in source order and do not overlap; each replaces whole tokens.

    Raises:
        WorldError: the result does not have the tokens that the edits intend.
    """
    pieces, at = [], 0
    for edit in edits:
        pieces += [source.data[at : edit.start], edit.text]
        at = edit.end
    result = b"".join([*pieces, source.data[at:]])
    _check(Source(data=result, name=source.name), _meant(tokens, edits))
    return result


def _meant(tokens: Sequence[Token], edits: Sequence[Patch]) -> list[bytes]:
    """Return the texts of the tokens that the result must have."""
    texts: list[bytes] = []
    at = 0
    for edit in edits:
        while tokens[at].end <= edit.start:
            texts.append(tokens[at].text)
            at += 1
        texts.extend(edit.tokens)
        while tokens[at].start < edit.end:
            at += 1
    texts.extend(token.text for token in tokens[at:])
    return texts


def _check(result: Source, meant: Sequence[bytes]) -> None:
    """Check that a result has the intended tokens.

    Both sequences end with the empty text, and no other token is empty, so a sequence of another length
    differs too.
    """
    for token, text in zip(tokenize(result), meant, strict=False):
        if token.text != text:
            fact = f"the generated world has {token.text!r} where {text!r} was meant"
            raise result.error(token.start, fact, "report this world; the generator has a bug")
