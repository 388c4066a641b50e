"""Trainers that serve their status on loopback addresses, correctly or with a fault.

The plan names the number of a response. This response and all later ones have the fault: they are slow, cut,
false or endless.
"""

import threading
import time
from dataclasses import replace
from typing import BinaryIO

from palaestra_protocol.pod.status import TrainerStatus
from tests.faults.course import Course
from tests.faults.plans import Kind
from tests.faults.requests import ANSWER, Asked
from tests.trainer_status import HEAD, StatusServer, answer

STATUS = TrainerStatus(step=12, target=20, episodes=3, phase="collecting", last_progress_age_s=0.0, attempt=1)
LIES = (
    replace(STATUS, step=10**18, target=10**18, attempt=10**9, steps_lost=10**18, phase="\x00" * 63),
    replace(STATUS, step=0, attempt=None, last_progress="9999-12-31T23:59:59Z", success_rate=1.0),
)
DRIBBLE_S = 0.2  # the pause between two bytes, so that a response takes a minute
ENDLESS = b" " * 65_536
MOST_PIECES = 4096  # 256 MiB in total, unless the operator closes the connection first


class Trainer:
    """The /status of a trainer, served on an address of its own until `close`.

    Attributes:
        host: the address.
        asked: the times of the requests, in seconds of the monotonic clock.
    """

    def __init__(self, course: Course | None) -> None:
        """Serve correct responses, or responses with the fault that the plan of `course` names."""
        self.asked: list[float] = []
        self._course = course
        self._is: Kind | None = None
        self._closing = threading.Event()
        self._server = StatusServer(self._answer)
        self.host = self._server.host

    def close(self) -> None:
        """Stop serving."""
        self._closing.set()
        self._server.close()

    def _counted(self) -> Kind | None:
        """Count a request, and return the fault of its response, or None."""
        self.asked.append(time.monotonic())
        if self._course is not None:
            fault = self._course.request(Asked(verb=ANSWER, resource="trainer"))
            self._is = self._is or (fault and fault.kind)
        return self._is

    def _answer(self, out: BinaryIO) -> None:
        kind = self._counted()
        status = LIES[len(self.asked) % len(LIES)] if kind == Kind.LIES else STATUS
        head, body = answer(status)
        if kind == Kind.SLOW:
            for number in range(len(head + body)):
                out.write((head + body)[number : number + 1])
                if self._closing.wait(DRIBBLE_S):
                    return
        elif kind == Kind.HALF:
            out.write(head + body[: len(body) // 2])
        elif kind == Kind.MUCH:
            out.write(HEAD + b"\r\n" + body)
            out.writelines(ENDLESS for _ in range(MOST_PIECES))
        else:
            out.write(head + body)
