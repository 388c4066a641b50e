"""The results (verdicts) of the checks of the jobs' worlds; a separate process checks large worlds.

No worker waits for a check in the separate process. A reconcile without a result reports that the worlds are
being checked. When the result is known, the checker queues the job again. Queued jobs do not keep their
worlds in memory: when its turn begins, a job is reconciled again and passes its worlds to the checker.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence

from palaestra.objects import Key
from palaestra.operator.fair_queue import FairQueue
from palaestra.plan import GivenWorld, WorldVerdict
from palaestra_sim.errors import WorldError
from palaestra_sim.world import check

MOST_BYTES_HERE = 16_384  # a worker itself checks worlds up to this total size, in less than 0.1 s
AT_ONCE = 2  # checks that run at the same time, for all namespaces together
REMEMBERED = 4000  # results in memory; the result of an invalid world has a message of at most 4 kB
# Within this many seconds after the start of a job's turn, a reconcile must call `verdicts` with the job's
# worlds. Otherwise the turn ends without a check.
HANDED_S = 10.0
PAUSE_S = 5.0  # pause in seconds after a check without a result: the node is busy or out of memory

Apart = Callable[[Sequence[GivenWorld]], Mapping[str, WorldVerdict]]


class WorldChecker:
    """Checks the worlds of jobs.

    Args:
        apart: checks worlds in a separate process; returns the results of the completed checks.
        wake: queues a job for a reconcile.
    """

    def __init__(self, apart: Apart, wake: Callable[[Key], None]) -> None:
        self._apart = apart
        self._wake = wake
        self._turns = FairQueue()
        self._lock = threading.Lock()
        # The keys are the digests of worlds. The result that was used last is at the end.
        self._known: OrderedDict[str, WorldVerdict] = OrderedDict()
        self._stopped = threading.Event()
        self._threads = [
            threading.Thread(target=self._run, name=f"check {number}", daemon=True)
            for number in range(AT_ONCE)
        ]

    def start(self) -> None:
        """Start the threads that run the checks."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Stop: no further check begins."""
        self._stopped.set()
        self._turns.close()

    def waits(self, key: Key) -> bool:
        """Return whether the worlds of a job wait for a check, or are under check."""
        return self._turns.waits(key)

    def verdicts(self, key: Key, worlds: Sequence[GivenWorld]) -> Mapping[str, WorldVerdict]:
        """Return the known results for a job's worlds; the other worlds are queued for a check."""
        missing = [world for world in worlds if self._recall(world.digest) is None]
        if missing and sum(len(world.source) for world in missing) <= MOST_BYTES_HERE:
            self._remember({world.digest: _checked(world) for world in missing})
            missing = []
        self._turns.hand_over(key, missing)
        found = {world.digest: self._recall(world.digest) for world in worlds}
        return {digest: verdict for digest, verdict in found.items() if verdict is not None}

    def forget(self, key: Key) -> None:
        """Remove a job from the queue of checks: it was deleted, or needs no check."""
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
    """Check a small world and return the result."""
    try:
        check(world.source, world.field)
    except WorldError as error:
        return WorldVerdict(problem=str(error))
    return WorldVerdict()
