"""Trainers that answer the operator on addresses of the loopback: as they should, or as a plan says.

From the answer on that the plan names, a trainer stays as it is: slow, halved, a liar, or one without an end.
"""

import http.server
import json
import threading
import time
from contextlib import suppress
from dataclasses import replace
from typing import Any

from palaestra.plan.layout import STATUS_PORT
from palaestra_sim.protocol.status import TrainerStatus
from tests.faults.course import Course
from tests.faults.plans import Kind
from tests.faults.requests import ANSWER, Asked

STATUS = TrainerStatus(step=12, target=20, episodes=3, phase="collecting", last_progress_age_s=0.0, attempt=1)
LIES = (
    replace(STATUS, step=10**18, target=10**18, attempt=10**9, steps_lost=10**18, phase="\x00" * 63),
    replace(STATUS, step=0, attempt=None, last_progress="9999-12-31T23:59:59Z", success_rate=1.0),
)
DRIBBLE_S = 0.2  # between two bytes: an answer takes a minute
ENDLESS = b" " * 65_536
MOST_PIECES = 4096  # 256 MiB, unless the operator hangs up
HEAD = b"HTTP/1.0 200 OK\r\nContent-Type: application/json\r\n"


class Trainer:
    """A trainer's /status on an address of its own, from now until it is closed.

    Attributes:
        host: its address.
        asked: when it was asked, in seconds of the monotonic clock.
    """

    def __init__(self, course: Course | None) -> None:
        """Serve honestly, or as the plan of `course` says."""
        self.asked: list[float] = []
        self._course = course
        self._is: Kind | None = None
        self._closing = threading.Event()
        self._server = _serving(type("Answer", (_Answer,), {"trainer": self}))
        self.host = str(self._server.server_address[0])
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    def answers(self) -> Kind | None:
        """Count a question and return how it is answered; None: as it should be."""
        self.asked.append(time.monotonic())
        if self._course is not None:
            fault = self._course.request(Asked(verb=ANSWER, resource="trainer"))
            self._is = self._is or (fault and fault.kind)
        return self._is

    @property
    def closing(self) -> threading.Event:
        """Set when everything is to end."""
        return self._closing

    def close(self) -> None:
        """End it."""
        self._closing.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class _Answer(http.server.BaseHTTPRequestHandler):
    trainer: Trainer

    def do_GET(self) -> None:
        with suppress(OSError):  # the operator hangs up when it has enough
            self._as(self.trainer.answers())

    def log_message(self, *_: Any) -> None:
        pass

    def _as(self, kind: Kind | None) -> None:
        status = LIES[len(self.trainer.asked) % len(LIES)] if kind == Kind.LIES else STATUS
        body = json.dumps(status.to_json()).encode()
        head = HEAD + b"Content-Length: %d\r\n\r\n" % len(body)
        if kind == Kind.SLOW:
            for number in range(len(head + body)):
                self.wfile.write((head + body)[number : number + 1])
                if self.trainer.closing.wait(DRIBBLE_S):
                    return
        elif kind == Kind.HALF:
            self.wfile.write(head + body[: len(body) // 2])
        elif kind == Kind.MUCH:
            self.wfile.write(HEAD + b"\r\n" + body)
            for _ in range(MOST_PIECES):
                self.wfile.write(ENDLESS)
        else:
            self.wfile.write(head + body)


def _serving(answer: type[_Answer]) -> http.server.ThreadingHTTPServer:
    """Return a server with a trainer's port, at an address of the loopback where it is free."""
    for last in range(1, 255):
        with suppress(OSError):  # another run's trainer has it
            return http.server.ThreadingHTTPServer((f"127.90.91.{last}", STATUS_PORT), answer)
    raise AssertionError(f"port {STATUS_PORT} is taken at every address")
