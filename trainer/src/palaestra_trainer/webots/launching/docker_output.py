"""Read the output of a container, and hold its standard input open."""

from __future__ import annotations

import contextlib
import queue
import threading
from typing import Any

from docker.utils.socket import frames_iter

from palaestra_trainer.errors import SimulatorDead

_STDERR = 2
_STREAMS = {"stdin": 1, "stdout": 1, "stderr": 1, "stream": 1}
_MOST_BYTES = 65536
_REST_S = 5.0


class ContainerOutput:
    """The output of a container that was created and not started yet.

    A thread reads the output until the container ends, because a full pipe would block the container. The
    output after the first line is dropped, except for the beginning of standard error.

    Args:
        container: the container. Its standard input is open until this program ends.

    Raises:
        docker.errors.APIError: the engine refuses the connection.
    """

    def __init__(self, container: Any) -> None:
        self._name = container.name
        self._line: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._errors = bytearray()
        self._ended = threading.Event()
        attached = container.attach_socket(params=_STREAMS)
        threading.Thread(target=self._read, args=(attached,), daemon=True).start()

    def first_line(self, deadline_s: float) -> str:
        """Return the first line of standard output; empty if the container ended without output.

        Raises:
            SimulatorDead: the container printed no line in time.
        """
        try:
            return self._line.get(timeout=deadline_s)
        except queue.Empty:
            raise SimulatorDead(self._name, f"printed nothing within {deadline_s:g} s") from None

    def rest(self) -> str:
        """Return the text that a container printed to standard error before it ended."""
        self._ended.wait(_REST_S)
        return self._errors.decode(errors="replace").strip()

    def _read(self, attached: Any) -> None:
        line = bytearray()
        # The engine may end, and `close` may close the connection while this thread reads.
        with contextlib.suppress(OSError, ValueError):
            for stream, text in frames_iter(attached, tty=False):
                if stream == _STDERR:
                    self._errors += text[: _MOST_BYTES - len(self._errors)]
                elif line[-1:] != b"\n" and len(line) < _MOST_BYTES:
                    head, end, _ = text.partition(b"\n")
                    line += head + end
                    if end:
                        self._line.put(line.decode(errors="replace"))
        if line[-1:] != b"\n":
            self._line.put(line.decode(errors="replace"))
        attached._response.close()
        self._ended.set()
