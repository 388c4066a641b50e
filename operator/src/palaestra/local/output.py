"""Write the output of containers to files, and show some of it.

Every line goes to `logs/<container>.log`, a file of limited size (`bounded_log`). The lines of some
containers are also shown.

The trainer may draw on the person's terminal instead. Then it gets a pseudo terminal of the same size, and
its output is copied unchanged. The log gets only whole lines, without colors and without overwritten text,
such as the earlier states of a progress bar.
"""

import asyncio
import fcntl
import os
import re
import struct
import sys
import termios
import tty
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from palaestra.local.bounded_log import LimitedFile
from palaestra.local.errors import StorageFailed
from palaestra.standard_output import drop_output

Show = Callable[[str], None]
KEPT_LINES = 20  # enough to show the reason for a program's end without the log file
CHUNK = 65536
RESTORED = b"\x1b[0m\x1b[?25h"  # resets the color and shows the cursor, which a killed program cannot do
_CONTROL = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|[@-_])")
_NO_SIZE = struct.pack("HHHH", 24, 80, 0, 0)


class Log:
    """The log of one container; the output after a restart is appended to the same file."""

    def __init__(self, name: str, folder: Path, show: Show | None = None) -> None:
        """Open the file.

        Raises:
            StorageFailed: the file cannot be written.
        """
        self.path = folder / f"{name}.log"
        self._show = show
        self._rest = b""
        self._tail: deque[str] = deque(maxlen=KEPT_LINES)
        self._open: set[asyncio.Future[None]] = set()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("a+b", buffering=0)
        except OSError as error:
            raise StorageFailed(
                f"{self.path}: {error.strerror}; free some space, or choose another folder with --dir"
            ) from error
        self._limited = LimitedFile(self._file.fileno())

    def begin(self, terminal: int | None = None) -> int:
        """Return a descriptor for the output of a program; the caller closes it after the program's start.

        With `terminal`, the descriptor is a pseudo terminal, and the output is copied to `terminal`.
        """
        reader, writer = os.pipe() if terminal is None else open_like(terminal)
        os.set_blocking(reader, False)
        loop = asyncio.get_running_loop()
        done: asyncio.Future[None] = loop.create_future()
        self._open.add(done)
        loop.add_reader(reader, self._read, reader, terminal, done)
        return writer

    async def finished(self, deadline_s: float) -> None:
        """Wait at most `deadline_s` until all programs have closed their descriptors."""
        if self._open:
            await asyncio.wait(self._open, timeout=deadline_s)

    def note(self, text: str) -> None:
        """Write a line of the runner itself, for example about the end of a program."""
        self._write(f"--- {text}")

    @property
    def last_lines(self) -> tuple[str, ...]:
        """Return the last lines of the output, at most twenty."""
        return tuple(self._tail)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _read(self, reader: int, terminal: int | None, done: "asyncio.Future[None]") -> None:
        try:
            data = os.read(reader, CHUNK)
        except BlockingIOError:  # no bytes to read
            return
        except OSError:  # EIO: all programs have closed their end of the pseudo terminal
            data = b""
        if terminal is not None:
            resize(reader, terminal)  # the person may have resized the window
            os.write(terminal, data or RESTORED)
        *lines, rest = (self._rest + data).split(b"\n")
        if not data and rest:
            lines, rest = [rest], b""
        self._rest = rest[max(rest.rfind(b"\r"), len(rest) - CHUNK, 0) :]  # drop text that was overwritten
        for line in lines:
            self._line(as_seen(line.decode(errors="replace")))
        if not data:
            asyncio.get_running_loop().remove_reader(reader)
            os.close(reader)
            self._open.discard(done)
            done.set_result(None)

    def _line(self, line: str) -> None:
        self._tail.append(line)
        self._write(line)
        if self._show is not None:
            self._show(line)

    def _write(self, line: str) -> None:
        self._limited.write(line.encode(errors="replace") + b"\n")


def say(text: str) -> None:
    """Print a line at once. If it cannot be written, drop it and all later lines, because the run goes on.

    A warning names the reason, unless the program that reads the lines has ended, such as `| head`.
    """
    try:
        sys.stdout.write(text + "\n")
        sys.stdout.flush()
    except OSError as error:
        drop_output()
        if not isinstance(error, BrokenPipeError):
            with suppress(OSError):
                sys.stderr.write(f"standard output: {error.strerror}; the run goes on without its lines\n")


def open_like(terminal: int) -> tuple[int, int]:
    """Return the two ends (ours, theirs) of a pseudo terminal with the size of `terminal`."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)  # line ends stay unchanged; the person's terminal converts them
    resize(ours, terminal)
    return ours, theirs


def resize(ours: int, terminal: int) -> None:
    """Set the size of the pseudo terminal to the size of `terminal`."""
    try:
        size = fcntl.ioctl(terminal, termios.TIOCGWINSZ, _NO_SIZE)
    except OSError:  # `terminal` is not a terminal, so it has no size
        size = _NO_SIZE
    fcntl.ioctl(ours, termios.TIOCSWINSZ, size)


def as_seen(line: str) -> str:
    """Return the visible text of a line, without control sequences and overwritten text."""
    return _CONTROL.sub("", line.rstrip("\r").rpartition("\r")[2])
