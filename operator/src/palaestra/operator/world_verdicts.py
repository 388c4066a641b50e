"""The verdicts on the worlds of jobs. Small worlds are checked here, larger ones in a separate process.

No worker waits for a check. A reconcile without a verdict reports that the worlds are being checked, and the
verdict queues the job again. Worlds are not stored in the meantime: at its turn, a job is queued to hand them
over.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence

from palaestra.objects import Key
from palaestra.operator.fair_queue import FairQueue
from palaestra.plan import GivenWorld, WorldVerdict
from palaestra_sim.errors import WorldError
from palaestra_sim.world import check

MOST_BYTES_HERE = 16_384  # the worker itself checks worlds up to this total, in less than 0.1 s
AT_ONCE = 2  # checks of all namespaces together
REMEMBERED = 4000  # verdicts, each with a message of at most 4 kB if it is a refusal
HANDED_S = 10.0  # for a job to hand over its worlds at its turn; after that, the next job has its turn
PAUSE_S = 5.0  # after a check without a verdict: the node is busy, or is out of memory

Apart = Callable[[Sequence[GivenWorld]], Mapping[str, WorldVerdict]]


class WorldChecker:
    """Checks the worlds of jobs.

    Args:
        apart: checks worlds in a separate process; returns the verdicts that it reached.
        wake: queues a job.
    """

    def __init__(self, apart: Apart, wake: Callable[[Key], None]) -> None:
        self._apart = apart
        self._wake = wake
        self._turns = FairQueue()
        self._lock = threading.Lock()
        self._known: OrderedDict[str, WorldVerdict] = OrderedDict()  # by digest, the last used at the end
        self._stopped = threading.Event()
        self._threads = [
            threading.Thread(target=self._run, name=f"check {number}", daemon=True)
            for number in range(AT_ONCE)
        ]

    def start(self) -> None:
        """Start the threads that wait for checks."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Begin no more checks."""
        self._stopped.set()
        self._turns.close()

    def waits(self, key: Key) -> bool:
        """Return whether the worlds of a job wait for their check, or are being checked."""
        return self._turns.waits(key)

    def verdicts(self, key: Key, worlds: Sequence[GivenWorld]) -> Mapping[str, WorldVerdict]:
        """Return the known verdicts on a job's worlds; the others follow, and queue the job."""
        missing = [world for world in worlds if self._recall(world.digest) is None]
        if missing and sum(len(world.source) for world in missing) <= MOST_BYTES_HERE:
            self._remember({world.digest: _checked(world) for world in missing})
            missing = []
        self._turns.hand_over(key, missing)
        found = {world.digest: self._recall(world.digest) for world in worlds}
        return {digest: verdict for digest, verdict in found.items() if verdict is not None}

    def forget(self, key: Key) -> None:
        """Forget a job that is gone or needs no check."""
        self._turns.hand_over(key, ())

    def _run(self) -> None:
        while (turn := self._turns.next()) is not None:
            self._wake(turn.key)
            if worlds := self._turns.handed(turn, HANDED_S):
                found = self._apart(worlds)
                self._remember(found)
                if not found:
                    self._stopped.wait(PAUSE_S)
            self._turns.end(turn)
            if worlds:
                self._wake(turn.key)

    def _remember(self, verdicts: Mapping[str, WorldVerdict]) -> None:
        with self._lock:
            self._known.update(verdicts)
            while len(self._known) > REMEMBERED:
                self._known.popitem(last=False)

    def _recall(self, digest: str) -> WorldVerdict | None:
        with self._lock:
            if digest not in self._known:
                return None
            self._known.move_to_end(digest)
            return self._known[digest]


def _checked(world: GivenWorld) -> WorldVerdict:
    """Return the verdict on a small world."""
    try:
        check(world.source, world.field)
    except WorldError as error:
        return WorldVerdict(problem=str(error))
    return WorldVerdict()
