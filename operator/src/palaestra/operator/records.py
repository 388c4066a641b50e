"""Since when what is waited for, of each TrainingJob: in memory only, and nobody needs it to go on."""

import threading

from palaestra.decide import Record
from palaestra.operator.poller import Key


class Records:
    """What the last look at each TrainingJob left to the next; safe to use from several threads.

    One that was made again under its name is another job.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[Key, tuple[str, Record]] = {}

    def of(self, key: Key, uid: str) -> Record:
        """Return what was kept of the job with this uid; an empty record where nothing was."""
        with self._lock:
            known_uid, record = self._known.get(key, (uid, Record()))
        return record if known_uid == uid else Record()

    def keep(self, key: Key, uid: str, record: Record) -> None:
        """Keep what a look has left."""
        with self._lock:
            self._known[key] = (uid, record)

    def forget(self, key: Key) -> None:
        """Forget a job that is gone."""
        with self._lock:
            self._known.pop(key, None)

    def clear(self) -> None:
        """Forget all of it."""
        with self._lock:
            self._known.clear()
