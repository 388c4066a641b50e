"""Lend this terminal to a container: it draws on it, and its log stays readable.

The container gets a terminal of its own, a pseudo terminal of the same size. What it writes is copied to
the person's terminal as it is. The log gets lines: what was drawn and redrawn in place, such as a
progress bar, is left out, and so are colours.
"""

import fcntl
import os
import re
import struct
import termios
import tty

_CONTROL = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|[@-_])")
RESTORED = b"\x1b[0m\x1b[?25h"  # no colour, and a cursor: a killed program leaves neither behind
_NO_SIZE = struct.pack("HHHH", 24, 80, 0, 0)


def open_like(terminal: int) -> tuple[int, int]:
    """Return (ours, theirs): the two ends of a pseudo terminal of the size of `terminal`."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)  # line ends stay as they are written; the person's terminal adds its own
    resize(ours, terminal)
    return ours, theirs


def resize(ours: int, terminal: int) -> None:
    """Give our end the size that `terminal` has now."""
    try:
        size = fcntl.ioctl(terminal, termios.TIOCGWINSZ, _NO_SIZE)
    except OSError:  # not a terminal, so it has no size
        size = _NO_SIZE
    fcntl.ioctl(ours, termios.TIOCSWINSZ, size)


def as_seen(line: str) -> str:
    """Return what is left of a line when all that was drawn over is gone."""
    return _CONTROL.sub("", line.rstrip("\r").rpartition("\r")[2])
