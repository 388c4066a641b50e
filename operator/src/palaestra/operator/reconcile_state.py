"""The records of the last reconcile of each TrainingJob, in memory only; a restart may lose them."""

import threading

from palaestra.decide import ReconcileRecord
from palaestra.objects import Key


class ReconcileRecords:
    """The record of each TrainingJob's last reconcile; safe to use from several threads.

    A TrainingJob that was deleted and created again is another job.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[Key, tuple[str, ReconcileRecord]] = {}

    def of(self, key: Key, uid: str) -> ReconcileRecord:
        """Return the record of the job with this uid, or an empty record."""
        with self._lock:
            known_uid, record = self._known.get(key, (uid, ReconcileRecord()))
        return record if known_uid == uid else ReconcileRecord()

    def keep(self, key: Key, uid: str, record: ReconcileRecord) -> None:
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
