"""Log files of limited size, which keep their first and last parts.

The first part has the start of a run, and the last part has its end. Without a limit, a program that prints
forever would fill the disk, and a full disk would end the run. The middle is cut out of the file itself,
because a second file might not fit on the disk. So the descriptor must be open for reading and for appending.
"""

import os
import re
from contextlib import suppress
from io import RawIOBase
from typing import Any

FIRST = 4 << 20  # bytes; the log of a trainer has about this size after some hours
LAST = 4 << 20
_NOTE = re.compile(rb"--- ([0-9]+) bytes were left out here; [^\n]*\n")
_LONGEST_NOTE = 200


class LimitedFile(RawIOBase):
    """A log file for appending; it never has more than `first + 2 * last` bytes.

    One exception: data that is longer than `last` is written whole.
    """

    def __init__(self, descriptor: int, first: int = FIRST, last: int = LAST) -> None:
        self._descriptor = descriptor
        self._first = first
        self._last = last

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, data: Any, /) -> int:
        """Append all bytes in `data`; first cut the middle out of the file if it would be too long.

        Bytes that cannot be written, for example on a full disk, are dropped: an error of a log must not end
        the run.
        """
        with suppress(OSError):
            size = os.fstat(self._descriptor).st_size
            if size > self._first + self._last and size + len(data) > self._first + 2 * self._last:
                self._cut(size)
            self._append(data)
        return len(data)

    def _cut(self, size: int) -> None:
        """Cut the middle of the file, but keep whole lines; the note also counts earlier cuts."""
        start = os.pread(self._descriptor, self._first, 0).rfind(b"\n") + 1
        tail = os.pread(self._descriptor, self._last, size - self._last)
        tail = tail[tail.find(b"\n") + 1 :]
        left_out = size - start - len(tail)
        if note := _NOTE.match(os.pread(self._descriptor, _LONGEST_NOTE, start)):
            left_out += int(note[1]) - len(note[0])
        os.ftruncate(self._descriptor, start)
        self._append(b"--- %d bytes were left out here; a log keeps its two ends\n" % left_out + tail)

    def _append(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._descriptor, rest) :]
