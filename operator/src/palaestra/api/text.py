"""Convert text of other programs into printable text for a status or a terminal."""

import re

from palaestra_protocol.masking import masked

_SPACES = re.compile(" +")


def one_line(text: str, most: int) -> str:
    """Return `text` as one line of at most `most` printable characters."""
    return flat(text.strip(), most).strip()


def printable(text: str) -> str:
    """Return text with its line breaks, but without control characters and passwords."""
    plain = "".join(letter if letter.isprintable() or letter in "\n\t" else " " for letter in text)
    return masked(plain)


def flat(text: str, most: int) -> str:
    """Return text like `one_line`, but reduce spaces at the beginning and the end to one space."""
    plain = "".join(letter if letter.isprintable() else " " for letter in text[: most * 4])
    words = _SPACES.sub(" ", masked(plain))
    return words if len(words) <= most else words[: most - 3] + "..."


def either(words: list[str]) -> str:
    """Return `a`, `a or b`, or `a, b or c`."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
