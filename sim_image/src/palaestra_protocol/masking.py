"""Mask the passwords in the URLs of a text before the process logs or sends the text."""

import re

# The part of a URL between the scheme and the host: a user, a password, or a token.
_USER_INFORMATION = re.compile(r"(?<=://)[^\s/?#]{1,4096}@")
MASK = "***@"


def masked(text: str) -> str:
    """Return `text` with `MASK` in place of the user and password of each URL."""
    return _USER_INFORMATION.sub(MASK, text) if "://" in text else text
