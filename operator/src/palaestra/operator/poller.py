"""Poll the status of running trainers over the pod network; the responses are untrusted.

A pod runs programs of the job's author. So each response has a deadline and a maximum size, and is parsed
strictly. A missing or malformed response means "unknown", never "stalled". The operator uses each response as
soon as it arrives; `poll_schedule` chooses the next trainer. The results are in memory only, so a restarted
operator polls all trainers again.
"""

import asyncio
import random
import threading
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from types import MappingProxyType

import structlog

from palaestra.objects import Key
from palaestra.observe import Polled
from palaestra.operator.poll_schedule import PollSchedule, PollState, PollStatus, PollTarget
from palaestra_protocol.pod.status import ProtocolError, TrainerStatus, decoded

PERIOD_S = 10.0
DEADLINE_S = 3.0  # seconds for one whole response
# A prompt response takes less than this share of the deadline; most responses take milliseconds.
PROMPT_SHARE = 1 / 3
FOLLOW_S = 1.0  # seconds between updates of the list of trainers
MOST_BYTES = 65_536  # limit of one response: enough for the longest faults of 32 simulators
MOST_HEAD_BYTES = 8192
REQUEST = "GET /status HTTP/1.0\r\nHost: {host}\r\nAccept: application/json\r\n\r\n"

log = structlog.get_logger(__name__)


class Poller:
    """Polls each target once a period, many at the same time, in one thread.

    Args:
        targets: returns the running trainers.
        changed: called with the key of a job whose trainer's response has changed.
        period_s: seconds between two requests to a trainer.
        deadline_s: seconds that one whole response may take; the first response of a pod may take a third of
            it.
    """

    def __init__(
        self,
        targets: Callable[[], Collection[PollTarget]],
        changed: Callable[[Key], None],
        *,
        period_s: float = PERIOD_S,
        deadline_s: float = DEADLINE_S,
    ) -> None:
        self._targets = targets
        self._changed = changed
        self._deadline_s = deadline_s
        self._follow_s = min(FOLLOW_S, period_s)
        self._schedule = PollSchedule(period_s, deadline_s * PROMPT_SHARE, random.random)
        self._known: dict[str, Polled] = {}
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="poller", daemon=True)

    def start(self) -> None:
        """Start polling; the first requests follow within a second."""
        self._thread.start()

    def stop(self, deadline_s: float) -> None:
        """Stop polling, and wait at most `deadline_s` for the thread, which ends within a second."""
        self._stopped.set()
        self._thread.join(deadline_s)

    def known(self) -> Mapping[str, Polled]:
        """Return the newest response by pod uid; a pod is absent if the last request to the pod failed."""
        return MappingProxyType(self._known)

    def _run(self) -> None:
        asyncio.run(self._ask_all())  # cancels open requests at the end

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

    async def _ask_and_take(self, entry: PollState, freed: asyncio.Event) -> None:
        answer = await self._ask(entry)
        if self._schedule.done(entry, time.monotonic()):
            self._take(entry.target, answer)
        freed.set()

    def _take(self, target: PollTarget, answer: Polled | None) -> None:
        before = self._known.pop(target.uid, None) if answer is None else self._known.get(target.uid)
        if answer is not None:
            self._known[target.uid] = answer
        if _word(before) != _word(answer):
            self._changed(target.key)

    async def _ask(self, entry: PollState) -> Polled | None:
        target = entry.target
        share = PROMPT_SHARE if entry.standing is PollStatus.NEW else 1.0
        try:
            async with asyncio.timeout(self._deadline_s * share):
                body = await _get_status(target)
            return Polled(status=TrainerStatus.from_json(decoded(body, MOST_BYTES)), at_s=time.monotonic())
        except (OSError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError) as error:
            log.debug("unreachable", job=target.key, pod=target.uid, error=type(error).__name__)
        except ProtocolError as error:
            if not entry.refused:  # log it once for each pod, so that bad responses do not fill the log
                log.warning("response refused", job=target.key, pod=target.uid, error=str(error))
            entry.refused = True
        except Exception:  # the response of one pod must not end the polling of all others
            if not entry.refused:
                log.exception("response not read", job=target.key, pod=target.uid)
            entry.refused = True
        return None


async def _get_status(target: PollTarget) -> bytes:
    """Return the body of a trainer's response.

    Raises:
        OSError: the trainer cannot be reached.
        ProtocolError: the response is malformed or too long.
    """
    reader, writer = await asyncio.open_connection(target.host, target.port, limit=MOST_HEAD_BYTES)
    try:
        host = f"[{target.host}]" if ":" in target.host else target.host
        writer.write(REQUEST.format(host=host).encode())
        head = await reader.readuntil(b"\r\n\r\n")
        version, _, status = head.partition(b"\r\n")[0].partition(b" ")
        if not version.startswith(b"HTTP/1.") or not status.startswith(b"200"):
            raise ProtocolError("head: the response is not HTTP 200")
        return await _read_all(reader)
    finally:
        writer.transport.abort()  # do not wait until the pod closes the connection


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
    """Return a trainer's status without its age, for comparison."""
    return None if answer is None else replace(answer.status, last_progress_age_s=None)
