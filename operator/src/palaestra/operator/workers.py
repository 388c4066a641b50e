"""Threads that take keys from the queue and reconcile them; two threads never have the same key.

An object that causes errors does not delay other objects. After an error, a worker logs the error, and
retries the key after a pause that grows with each failure. Meanwhile the workers reconcile the other keys.
"""

import threading
import time
from collections.abc import Callable

import structlog
from prometheus_client import Histogram

from palaestra.cluster import ApiError, Conflict, WorkQueue
from palaestra.objects import Key
from palaestra.operator.fenced_client import NotLeading
from palaestra.operator.preconditions import Outdated

IDLE_S = 1.0  # seconds between two checks of the stop condition
REPEATS = 4  # consecutive conflicts of a key before the first log line; the next lines are at 8, 16, 32, ...
IN_DOUBT_S = 1.0  # seconds until the next try of a key while it is uncertain whether this operator leads
# Seconds after which a reconcile counts as stuck. Every call has a deadline, so a reconcile is normally
# shorter.
STUCK_S = 300.0

log = structlog.get_logger(__name__)

Reconcile = Callable[[Key], float | None]


class Workers:
    """Threads that work on one queue.

    Args:
        queue: the namespace and name of each job to reconcile.
        reconcile: reconciles one job; returns the seconds until the next reconcile, or None.
        gate: a reconcile starts only while this event is set.
        seconds: the histogram for the durations of reconciles, with the label `result`.
        count: number of threads.
    """

    def __init__(
        self,
        queue: WorkQueue[Key],
        reconcile: Reconcile,
        *,
        gate: threading.Event,
        seconds: Histogram,
        count: int,
    ) -> None:
        self._queue = queue
        self._reconcile = reconcile
        self._gate = gate
        self._seconds = seconds
        self._began: dict[str, float] = {}
        self._threads = [
            threading.Thread(target=self._run, name=f"worker {i}", daemon=True) for i in range(count)
        ]

    def start(self) -> None:
        """Start the threads; they work while the gate is set."""
        for thread in self._threads:
            thread.start()

    def stop(self, deadline_s: float) -> None:
        """Close the queue and wait at most `deadline_s` for work in progress."""
        self._queue.close()
        ends = time.monotonic() + deadline_s
        for thread in self._threads:
            if thread.ident is not None:
                thread.join(max(0.0, ends - time.monotonic()))

    def trouble(self) -> str | None:
        """Return a sentence about a stuck thread, or None; only a restart solves this problem."""
        now = time.monotonic()
        for thread in self._threads:
            if now - self._began.get(thread.name, now) > STUCK_S:
                return f"{thread.name} is stuck"
        return None

    def _run(self) -> None:
        name = threading.current_thread().name
        while not self._queue.closed:
            if not self._gate.wait(IDLE_S):
                continue
            key = self._queue.get(IDLE_S)
            if key is None:
                continue
            began = self._began[name] = time.monotonic()
            result = self._work(key)
            self._queue.done(key)
            del self._began[name]
            self._seconds.labels(result).observe(time.monotonic() - began)

    def _work(self, key: Key) -> str:
        """Reconcile one key, and return the result."""
        try:
            again_s = self._reconcile(key)
        # Another client changed the object; the cache receives the change soon.
        except (Conflict, Outdated) as error:
            self._retry_conflict(key, error)
            return "conflict"
        except NotLeading:  # another leader reconciles all jobs, or this operator renewed its Lease late
            self._queue.add_after(key, IN_DOUBT_S)
            return "conflict"
        except ApiError as error:
            log.warning("refused", job=key, error=str(error), again_in_s=self._retry(key))
            return "error"
        except Exception:  # an error from one job must not end the worker of all others
            log.exception("not reconciled", job=key, again_in_s=self._retry(key))
            return "error"
        self._queue.forget(key)
        if again_s is not None:
            self._queue.add_after(key, again_s)
        return "done"

    def _retry_conflict(self, key: Key, error: Exception) -> None:
        """Retry later; log only repeated conflicts of a key, and log them ever more rarely."""
        again_s = self._retry(key)
        times = self._queue.failures(key)
        if times >= REPEATS and times & (times - 1) == 0:
            log.info("conflict repeats", job=key, times=times, error=str(error), again_in_s=again_s)

    def _retry(self, key: Key) -> float:
        return round(self._queue.retry(key), 2)
