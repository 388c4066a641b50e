"""Mask the passwords in the addresses of a text before it leaves the process."""

import re

# The part between the scheme and the host of an address: a user, a password, or a token.
_USER_INFORMATION = re.compile(r"(?<=://)[^\s/?#]{1,4096}@")
MASK = "***@"


def masked(text: str) -> str:
    """Return text in which the user information of each address is masked."""
    return _USER_INFORMATION.sub(MASK, text) if "://" in text else text
