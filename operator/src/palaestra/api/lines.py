"""Text that comes from elsewhere, made fit for a status and a terminal."""

import re

_SPACES = re.compile(" +")


def one_line(text: str, most: int) -> str:
    """Return `text` on one line of printable characters, cut to `most` of them."""
    return flat(text.strip(), most).strip()


def flat(text: str, most: int) -> str:
    """Return the same with a space at either end where there was some."""
    plain = "".join(letter if letter.isprintable() else " " for letter in text[: most * 4])
    words = _SPACES.sub(" ", plain)
    return words if len(words) <= most else words[: most - 3] + "..."
