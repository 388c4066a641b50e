"""A token in a file; the kubelet or another program replaces the token before it expires."""

from collections.abc import Callable
from pathlib import Path

from palaestra.cluster.errors import Unreachable

FRESH_S = 60.0  # seconds until the next read; a kubelet replaces a token minutes before the token expires


class FileToken:
    """The token in a file; the file is read again after a minute."""

    def __init__(self, file: Path, clock: Callable[[], float]) -> None:
        self._file = file
        self._clock = clock
        self._text = ""
        self._read_at = float("-inf")

    def __call__(self) -> str:
        """Return the header `Authorization` with the token.

        Raises:
            Unreachable: the token cannot be read.
        """
        if self._clock() - self._read_at >= FRESH_S:
            self._text = text_of(self._file)
            if not self._text.isprintable() or not self._text:
                fact = (
                    "has a character that cannot be printed, such as a line break"
                    if self._text
                    else "is missing, empty, unreadable or not ASCII"
                )
                raise Unreachable(0, "NoCredentials", f"{self._file} {fact}")
            self._read_at = self._clock()
        return f"Bearer {self._text}"


def text_of(file: Path) -> str:
    """Return the text of a file without the white space around it; "" if the file cannot be read."""
    try:
        return file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""
