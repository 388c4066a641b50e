"""The records of the last reconcile of each TrainingJob, in memory only; a restart may lose them."""

import threading

from palaestra.decide import Record
from palaestra.objects import Key


class Records:
    """The record of each TrainingJob's last reconcile; safe to use from several threads.

    A TrainingJob that was deleted and created again is another job.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[Key, tuple[str, Record]] = {}

    def of(self, key: Key, uid: str) -> Record:
        """Return the record of the job with this uid; an empty one if there is none."""
        with self._lock:
            known_uid, record = self._known.get(key, (uid, Record()))
        return record if known_uid == uid else Record()

    def keep(self, key: Key, uid: str, record: Record) -> None:
        """Keep the record of a reconcile."""
        with self._lock:
            self._known[key] = (uid, record)

    def forget(self, key: Key) -> None:
        """Forget a job that is gone."""
        with self._lock:
            self._known.pop(key, None)

    def clear(self) -> None:
        """Forget all records."""
        with self._lock:
            self._known.clear()
