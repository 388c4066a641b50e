"""Write lines of the simulator and of the sidecar to standard output.

Each line is one write, and is short enough that a write to a pipe is atomic. So the lines of several writers
do not mix, although the writers use no lock. If a simulator prints faster than the container runtime reads,
the simulator has to wait, because the sidecar buffers only one line.
"""

import logging
import os
import select

from palaestra_protocol.masking import masked

STDOUT = 1
MOST_LINE = select.PIPE_BUF  # 4096: the maximum number of bytes that Linux writes to a pipe atomically
_CHUNK = 65536


def write_line(line: bytes) -> None:
    """Write a line that ends in a newline; ignore a closed pipe."""
    try:
        while line:
            line = line[os.write(STDOUT, line) :]
    except BrokenPipeError:
        return


class LineHandler(logging.Handler):
    """Writes each log record as one line that begins with the program's name."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write one record."""
        text = f"palaestra-sidecar: {masked(record.getMessage())}".encode("utf-8", "replace")
        write_line(text[: MOST_LINE - 1].replace(b"\n", b" ") + b"\n")


class Passage:
    """Forwards the output of a simulator, line by line, from a pipe to standard output.

    Args:
        source: the read end of the pipe.
        mark: the prefix of each line.

    Attributes:
        last_line: the last non-empty line, as text.
    """

    def __init__(self, source: int, mark: str = "") -> None:
        self.last_line = ""
        self._source = source
        self._mark = mark.encode()
        self._most = MOST_LINE - 1 - len(self._mark)

    def run(self) -> None:
        """Forward all output; when all writers have closed the pipe, close the read end and return."""
        rest = b""
        while chunk := os.read(self._source, _CHUNK):
            *lines, rest = (rest + chunk).split(b"\n")
            for line in lines:
                self._pass_on(line)
            while len(rest) > self._most:
                self._pass_on(rest[: self._most])
                rest = rest[self._most :]
        if rest:
            self._pass_on(rest)
        os.close(self._source)

    def _pass_on(self, line: bytes) -> None:
        """Write one line, in several parts if it is too long."""
        if line.strip():
            self.last_line = line[:MOST_LINE].decode("utf-8", "replace").strip()
        for start in range(0, max(1, len(line)), self._most):
            write_line(self._mark + line[start : start + self._most] + b"\n")
