"""Report the state of a job: write the status once if it changed, then write the events.

An event about a change that is not in the status would be wrong, so events are written after the status.
Changed conditions and phases are written at once, but progress alone at most every 30 seconds.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palaestra.api.reasons import Reason
from palaestra.cluster import NotFound, Recorder
from palaestra.decide import Decision, EmittedEvent, as_data, fitted, write_in_s
from palaestra.objects import Key, Object
from palaestra.operator.fenced_client import FencedClient, difference
from palaestra.operator.preconditions import Outdated
from palaestra.operator.unwatched_facts import Denied

Written = Callable[[Object, Object], None]
Accepted = Callable[[Any, dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusWrite:
    """The result of a status write.

    Attributes:
        stored: the TrainingJob that the API server returned; None: no status was written.
        again_s: seconds until the delayed progress must be written; None: no write was delayed.
    """

    stored: Object | None = None
    again_s: float | None = None


class StatusWriter:
    """Writes status and events of TrainingJobs; safe to use from several threads.

    Args:
        writer: writes the status.
        recorder: writes the events.
        written: called after each write with the old TrainingJob and the written status.
        accepted: returns the part of a status that the cluster's definition allows; its first argument is the
            stored status.
    """

    def __init__(
        self, writer: FencedClient, recorder: Recorder, written: Written, accepted: Accepted
    ) -> None:
        self._writer = writer
        self._count = written
        self._accepted = accepted
        self._recorder = recorder
        self._lock = threading.Lock()
        self._written: dict[Key, float] = {}
        self._futile: dict[Key, tuple[str, Object]] = {}

    def report(self, raw: Object, decision: Decision, denied: Denied, clock_s: float) -> StatusWrite:
        """Write the status if it changed, then the events; `clock_s` is the monotonic clock.

        Refused creations emit no `Planned` event; the next reconcile sets the reason in the status.

        Raises:
            Conflict: the job has changed since the decision.
            Outdated: the job was deleted.
            NamespaceTerminating: the status was written, but events can no longer be written.
            NotLeading: another operator may lead.
        """
        key = (raw["metadata"]["namespace"], raw["metadata"]["name"])
        written = StatusWrite()
        if decision.status is not None:
            status = self._accepted(raw.get("status"), as_data(decision.status))
            written = self._write(key, raw, fitted(raw, status), clock_s)
        for event in decision.events:
            if event.reason != Reason.PLANNED or not denied.keys() & {None, event.replica}:
                self._record(raw, event)
        return written

    def _record(self, raw: Object, event: EmittedEvent) -> None:
        whose = "" if event.replica is None else f"replica {event.replica}: "
        self._recorder.record(raw, event.type, event.reason, whose + event.message, once=event.once)

    def _write(self, key: Key, raw: Object, status: dict[str, Any], clock_s: float) -> StatusWrite:
        old = raw.get("status")
        with self._lock:
            last_s = self._written.get(key)
        in_s = write_in_s(old, status, None if last_s is None else clock_s - last_s)
        if in_s is None or in_s > 0:
            return StatusWrite(again_s=in_s)
        patch, version = difference(old, status), raw["metadata"]["resourceVersion"]
        with self._lock:
            if self._futile.get(key) == (version, patch):
                return StatusWrite()
        try:
            stored = self._writer.status(raw, patch)
        except NotFound as error:
            raise Outdated(f"TrainingJob {key[1]} was deleted but is still in the cache") from error
        changed = stored["metadata"]["resourceVersion"] != version
        if changed:
            self._count(raw, status)
        with self._lock:
            self._written[key] = clock_s
            # An older CustomResourceDefinition prunes new fields. Then this patch has no effect, and a retry
            # would have no effect either.
            self._futile.pop(key, None)
            if not changed:
                self._futile[key] = (version, patch)
        return StatusWrite(stored=stored)

    def forget(self, key: Key) -> None:
        """Drop the records of a deleted TrainingJob."""
        with self._lock:
            self._written.pop(key, None)
            self._futile.pop(key, None)
