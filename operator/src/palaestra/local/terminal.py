"""Let a container draw on this terminal, and keep its log readable.

The container gets a pseudo terminal of the same size. Its output is copied unchanged to the person's
terminal. The log gets only whole lines, without colors and without text that was redrawn in place, such as
a progress bar.
"""

import fcntl
import os
import re
import struct
import termios
import tty

_CONTROL = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|[@-_])")
RESTORED = b"\x1b[0m\x1b[?25h"  # no color, and a visible cursor; a killed program does not restore them
_NO_SIZE = struct.pack("HHHH", 24, 80, 0, 0)


def open_like(terminal: int) -> tuple[int, int]:
    """Return (ours, theirs): the two ends of a pseudo terminal with the size of `terminal`."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)  # line ends stay unchanged; the person's terminal converts them
    resize(ours, terminal)
    return ours, theirs


def resize(ours: int, terminal: int) -> None:
    """Set the size of our end to that of `terminal`."""
    try:
        size = fcntl.ioctl(terminal, termios.TIOCGWINSZ, _NO_SIZE)
    except OSError:  # not a terminal, so it has no size
        size = _NO_SIZE
    fcntl.ioctl(ours, termios.TIOCSWINSZ, size)


def as_seen(line: str) -> str:
    """Return the visible text of a line, without overwritten text."""
    return _CONTROL.sub("", line.rstrip("\r").rpartition("\r")[2])
