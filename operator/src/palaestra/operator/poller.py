"""Ask running trainers where they stand, over the pod network, and believe little of it.

A pod runs programs that its author chose. So an answer has a deadline as a whole, a largest size, and
is read strictly; what is no answer is "unknown", never "stalled". Results live in memory only: an
operator that has just started knows nothing, and asks.
"""

import asyncio
import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import structlog

from palaestra.observe import Polled
from palaestra_sim.protocol.status import ProtocolError, TrainerStatus, decoded

PERIOD_S = 10.0
DEADLINE_S = 3.0  # of one answer, from the connection to its last byte
MOST_BYTES = 65_536  # of one answer; 32 simulators with their longest faults fit
MOST_HEAD_BYTES = 8192
MOST_AT_ONCE = 64
REQUEST = "GET /status HTTP/1.0\r\nHost: {host}\r\nAccept: application/json\r\n\r\n"

log = structlog.get_logger(__name__)

Key = tuple[str, str]  # namespace and name of a TrainingJob


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A trainer to ask: the pod's uid and address, and the job that it belongs to."""

    key: Key
    uid: str
    host: str
    port: int


class Poller:
    """Asks all targets every period, many at once, in one thread of its own.

    Args:
        targets: returns the trainers that run now.
        changed: is told the key of a job of which something else is known than before.
        period_s: seconds between two rounds.
        deadline_s: seconds that one answer may take as a whole.
    """

    def __init__(
        self,
        targets: Callable[[], Collection[Target]],
        changed: Callable[[Key], None],
        *,
        period_s: float = PERIOD_S,
        deadline_s: float = DEADLINE_S,
    ) -> None:
        self._targets = targets
        self._changed = changed
        self._period_s = period_s
        self._deadline_s = deadline_s
        self._known: Mapping[str, Polled] = {}
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="poller", daemon=True)

    def start(self) -> None:
        """Ask from now on, for the first time at once."""
        self._thread.start()

    def stop(self, deadline_s: float) -> None:
        """Ask no more; an answer that is under way is waited for until `deadline_s`."""
        self._stopped.set()
        self._thread.join(deadline_s)

    def known(self) -> Mapping[str, Polled]:
        """Return the newest answers by the pod's uid; who did not answer last time is not among them."""
        return self._known

    def _run(self) -> None:
        while not self._stopped.is_set():
            targets = self._targets()
            if targets:
                self._take(targets, asyncio.run(self._ask_all(targets)))
            self._stopped.wait(self._period_s)

    def _take(self, targets: Collection[Target], answers: Mapping[str, Polled]) -> None:
        before, self._known = self._known, answers
        for key in {each.key for each in targets if _word(before, each) != _word(answers, each)}:
            self._changed(key)

    async def _ask_all(self, targets: Collection[Target]) -> Mapping[str, Polled]:
        places = asyncio.Semaphore(MOST_AT_ONCE)

        async def ask(target: Target) -> Polled | None:
            async with places:
                return await self._ask(target)

        answers = await asyncio.gather(*(ask(each) for each in targets))
        found = zip(targets, answers, strict=True)
        return {target.uid: answer for target, answer in found if answer is not None}

    async def _ask(self, target: Target) -> Polled | None:
        try:
            async with asyncio.timeout(self._deadline_s):
                body = await _get_status(target)
            status = TrainerStatus.from_json(decoded(body, MOST_BYTES))
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError) as error:
            log.debug("unreachable", job=target.key, pod=target.uid, error=type(error).__name__)
            return None
        except ProtocolError as error:
            log.warning("answer refused", job=target.key, pod=target.uid, error=str(error))
            return None
        return Polled(status=status, at=datetime.now(UTC))


async def _get_status(target: Target) -> bytes:
    """Return the body of a trainer's answer.

    Raises:
        OSError: it cannot be reached.
        ProtocolError: what came is no answer, or too long.
    """
    reader, writer = await asyncio.open_connection(target.host, target.port, limit=MOST_HEAD_BYTES)
    try:
        host = f"[{target.host}]" if ":" in target.host else target.host
        writer.write(REQUEST.format(host=host).encode())
        head = await reader.readuntil(b"\r\n\r\n")
        version, _, status = head.partition(b"\r\n")[0].partition(b" ")
        if not version.startswith(b"HTTP/1.") or not status.startswith(b"200"):
            raise ProtocolError("head: the answer is not 200 of HTTP")
        return await _read_all(reader)
    finally:
        writer.transport.abort()  # nothing is left to say, and nobody waits for a pod to close


async def _read_all(reader: asyncio.StreamReader) -> bytes:
    body = bytearray()
    while piece := await reader.read(MOST_BYTES):
        body += piece
        if len(body) > MOST_BYTES:
            raise ProtocolError(f"body: more than {MOST_BYTES} bytes")
    return bytes(body)


def _word(answers: Mapping[str, Polled], target: Target) -> TrainerStatus | None:
    """Return what a trainer says, whenever it said it."""
    answer = answers.get(target.uid)
    return None if answer is None else answer.status
