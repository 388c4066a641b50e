"""Ask running trainers where they stand, over the pod network, and believe little of it.

A pod runs programs that its author chose. So an answer has a deadline as a whole, a largest size, and
is read strictly; what is no answer is "unknown", never "stalled". Each answer is used as it comes; who is
asked when is decided in `schedule`. Results live in memory only: an operator that has just started knows
nothing, and asks.
"""

import asyncio
import random
import threading
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from types import MappingProxyType

import structlog

from palaestra.observe import Polled
from palaestra.operator.schedule import Entry, Schedule, Standing, Target
from palaestra_protocol.pod.status import ProtocolError, TrainerStatus, decoded

PERIOD_S = 10.0
DEADLINE_S = 3.0  # of one answer, from the connection to its last byte
PROMPT_SHARE = 1 / 3  # of the deadline; a trainer answers within milliseconds
FOLLOW_S = 1.0  # between two looks at which trainers there are
MOST_BYTES = 65_536  # of one answer; 32 simulators with their longest faults fit
MOST_HEAD_BYTES = 8192
REQUEST = "GET /status HTTP/1.0\r\nHost: {host}\r\nAccept: application/json\r\n\r\n"

log = structlog.get_logger(__name__)

Key = tuple[str, str]  # namespace and name of a TrainingJob


class Poller:
    """Asks each target every period, many at once, in one thread of its own.

    Args:
        targets: returns the trainers that run now.
        changed: is told the key of a job of which something else is known than before.
        period_s: seconds between two questions to a trainer.
        deadline_s: seconds that one answer may take as a whole; a third of it for a first question.
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
        self._deadline_s = deadline_s
        self._follow_s = min(FOLLOW_S, period_s)
        self._schedule = Schedule(period_s, deadline_s * PROMPT_SHARE, random.random)
        self._known: dict[str, Polled] = {}
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="poller", daemon=True)

    def start(self) -> None:
        """Ask from now on, for the first time within a second."""
        self._thread.start()

    def stop(self, deadline_s: float) -> None:
        """Ask no more; the thread ends within a second, and is waited for until `deadline_s`."""
        self._stopped.set()
        self._thread.join(deadline_s)

    def known(self) -> Mapping[str, Polled]:
        """Return the newest answers by the pod's uid; who did not answer last time is not among them."""
        return MappingProxyType(self._known)

    def _run(self) -> None:
        asyncio.run(self._ask_all())  # what is under way at the end is cancelled

    async def _ask_all(self) -> None:
        under_way: set[asyncio.Task[None]] = set()
        freed, follow_at_s = asyncio.Event(), time.monotonic()
        while not self._stopped.is_set():
            freed.clear()
            if time.monotonic() >= follow_at_s:
                self._follow()
                follow_at_s = time.monotonic() + self._follow_s
            for entry in self._schedule.due(time.monotonic()):
                task = asyncio.create_task(self._ask_and_take(entry, freed))
                under_way.add(task)
                task.add_done_callback(under_way.discard)
            next_s = min(follow_at_s, self._schedule.next_s() or follow_at_s)
            await _wait(freed, next_s - time.monotonic())

    def _follow(self) -> None:
        for target in self._schedule.follow(self._targets(), time.monotonic()):
            self._take(target, None)

    async def _ask_and_take(self, entry: Entry, freed: asyncio.Event) -> None:
        answer = await self._ask(entry)
        if self._schedule.done(entry, time.monotonic()):
            self._take(entry.target, answer)
        freed.set()

    def _take(self, target: Target, answer: Polled | None) -> None:
        before = self._known.pop(target.uid, None) if answer is None else self._known.get(target.uid)
        if answer is not None:
            self._known[target.uid] = answer
        if _word(before) != _word(answer):
            self._changed(target.key)

    async def _ask(self, entry: Entry) -> Polled | None:
        target = entry.target
        share = PROMPT_SHARE if entry.standing is Standing.NEW else 1.0
        try:
            async with asyncio.timeout(self._deadline_s * share):
                body = await _get_status(target)
            return Polled(status=TrainerStatus.from_json(decoded(body, MOST_BYTES)), at_s=time.monotonic())
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError) as error:
            log.debug("unreachable", job=target.key, pod=target.uid, error=type(error).__name__)
        except ProtocolError as error:
            if not entry.refused:  # once a pod: one that lies for ever does not fill the log
                log.warning("answer refused", job=target.key, pod=target.uid, error=str(error))
            entry.refused = True
        except Exception:  # what one pod answers must not end the asking of all others
            if not entry.refused:
                log.exception("answer not read", job=target.key, pod=target.uid)
            entry.refused = True
        return None


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


async def _wait(event: asyncio.Event, seconds: float) -> None:
    """Wait for an event, `seconds` at most."""
    try:
        async with asyncio.timeout(max(0.0, seconds)):
            await event.wait()
    except TimeoutError:
        return


def _word(answer: Polled | None) -> TrainerStatus | None:
    """Return what a trainer says, whenever it said it."""
    return None if answer is None else replace(answer.status, last_progress_age_s=None)
