"""Choose the next trainer to poll, and its time. This module uses no clock and no sockets.

Each trainer has its own next time, so no trainer waits for the slowest one. The open requests share a limited
number of slots (`PLACES`). Two rules keep a pod from taking the slots of other pods. First, prompt, new and
slow trainers have separate slots. Second, the namespaces of the trainers that wait for a slot take turns.
"""

import heapq
from collections import OrderedDict, deque
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from enum import Enum

from palaestra.objects import Key

FIRST_S = 1.0  # seconds within which a new trainer is polled for the first time


class PollStatus(Enum):
    """The result of the last request to a trainer."""

    # The request ended soon, with or without a response. For example, a refused connection ends at once, and
    # does not delay other requests.
    PROMPT = "prompt"
    NEW = "new"  # no request was sent yet
    SLOW = "slow"


PLACES = {
    PollStatus.PROMPT: 40,
    PollStatus.NEW: 16,
    PollStatus.SLOW: 8,
}  # at most 64 responses at a time, each at most 64 KiB: together 4 MiB


@dataclass(frozen=True, slots=True, kw_only=True)
class PollTarget:
    """A trainer to poll: the pod's uid and address, and the key of its job."""

    key: Key
    uid: str
    host: str
    port: int


@dataclass(slots=True, kw_only=True, eq=False)
class PollState:
    """The state of a target: time and result of its last request, and whether a bad response was logged."""

    target: PollTarget
    standing: PollStatus = PollStatus.NEW
    asked_s: float = 0.0
    refused: bool = False


@dataclass(slots=True)
class _Turns:
    """Entries that wait for a slot: namespaces take turns; each namespace is first in, first out."""

    waiting: OrderedDict[str, deque[PollState]] = field(default_factory=OrderedDict)

    def put(self, entry: PollState) -> None:
        self.waiting.setdefault(entry.target.key[0], deque()).append(entry)

    def take(self) -> PollState | None:
        if not self.waiting:
            return None
        namespace, entries = self.waiting.popitem(last=False)
        entry = entries.popleft()
        if entries:
            self.waiting[namespace] = entries  # the namespace is now behind all others
        return entry


class PollSchedule:
    """Chooses the targets to poll now. Times are seconds of a monotonic clock.

    Args:
        period_s: longest time in seconds between two requests to a trainer, while slots are free.
        prompt_s: seconds after which a request counts as slow.
        spread: returns a random number from 0 to 1, which spreads the requests to a thousand trainers.
    """

    def __init__(self, period_s: float, prompt_s: float, spread: Callable[[], float]) -> None:
        self._period_s = period_s
        self._prompt_s = prompt_s
        self._spread = spread
        self._entries: dict[str, PollState] = {}
        self._times: list[tuple[float, int, PollState]] = []
        self._numbered = 0  # orders entries of the same time
        self._waiting = {standing: _Turns() for standing in PollStatus}
        self._free = dict(PLACES)

    def follow(self, targets: Collection[PollTarget], now_s: float) -> list[PollTarget]:
        """Replace the targets to poll; return the targets that are no longer polled."""
        wanted = {target.uid: target for target in targets}
        gone = [entry.target for uid, entry in self._entries.items() if wanted.get(uid) != entry.target]
        for target in gone:
            del self._entries[target.uid]
        for uid in wanted.keys() - self._entries.keys():
            first_s = now_s + self._spread() * min(FIRST_S, self._period_s)
            self._entries[uid] = entry = PollState(target=wanted[uid])
            self._at(entry, first_s)
        return gone

    def due(self, now_s: float) -> Iterator[PollState]:
        """Yield the targets to poll now; each occupies a slot until `done` is called with it."""
        while self._times and self._times[0][0] <= now_s:
            entry = heapq.heappop(self._times)[-1]
            if self.follows(entry):
                self._waiting[entry.standing].put(entry)
        for standing, turns in self._waiting.items():
            while self._free[standing] and (found := turns.take()) is not None:
                if self.follows(found):
                    self._free[standing] -= 1
                    found.asked_s = now_s
                    yield found

    def done(self, entry: PollState, now_s: float) -> bool:
        """Free the slot of a request; return whether its target must still be polled."""
        self._free[entry.standing] += 1
        if not self.follows(entry):
            return False
        first = entry.standing is PollStatus.NEW
        entry.standing = PollStatus.PROMPT if now_s - entry.asked_s < self._prompt_s else PollStatus.SLOW
        # The first wait varies more, so that trainers that were found at the same time get requests at
        # different times.
        least = 0.2 if first else 0.8
        self._at(entry, now_s + self._period_s * (least + (1.0 - least) * self._spread()))
        return True

    def follows(self, entry: PollState) -> bool:
        """Return whether a target must still be polled."""
        return self._entries.get(entry.target.uid) is entry

    def next_s(self) -> float | None:
        """Return the time at which the next target is due, or None.

        A target that already waits for a slot does not count.
        """
        return self._times[0][0] if self._times else None

    def _at(self, entry: PollState, due_s: float) -> None:
        self._numbered += 1
        heapq.heappush(self._times, (due_s, self._numbered, entry))
