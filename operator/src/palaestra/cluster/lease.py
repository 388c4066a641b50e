"""Leader election: only one of several operators reconciles at a time.

Candidates take and renew one Lease object. Each write names the resourceVersion that the candidate has read,
so the API server refuses the second of two concurrent writes. `leads()` reads the clock at each call. So the
first call after a process was paused for a minute returns False (see lease_timing.py). The election only
avoids duplicate work. Correctness does not depend on the election: names are deterministic, and the API
server refuses a second object of the same name.
"""

import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import structlog

from palaestra.cluster.api import Api
from palaestra.cluster.errors import AlreadyExists, ApiError, Conflict, NotFound
from palaestra.cluster.lease_timing import LeaseSpec, ObservedLease, Tenure
from palaestra.cluster.resources import LEASES
from palaestra.objects import Object

log = structlog.get_logger("palaestra.cluster")

DURATION_S = 15.0
RENEW_S = 3.0  # seconds between renewals; three may fail before the leader must stop


def _nothing() -> None:
    """Do nothing."""


class Leadership:
    """A candidate for one Lease, which leads while `leads()` returns True."""

    def __init__(
        self,
        api: Api,
        namespace: str,
        name: str,
        identity: str,
        *,
        duration_s: float = DURATION_S,
        renew_s: float = RENEW_S,
    ) -> None:
        """Prepare the candidate; it sends no request before `start`.

        Args:
            api: the API server that stores the Lease.
            namespace: the namespace of the Lease.
            name: the name of the Lease.
            identity: the identity of this process; no other process may have it.
            duration_s: whole seconds after which another candidate may replace a leader that has died.
            renew_s: seconds between two renewals, or between two reads of another leader's Lease; at most a
                third of `duration_s`.
        """
        self._api = api.within(renew_s)
        self._namespace, self._name, self._identity = namespace, name, identity
        self._duration_s = duration_s
        self._renew_s = renew_s
        self._sighting = ObservedLease()
        self._tenure: Tenure | None = None
        self._terms = 0
        self._version = ""
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="leadership", daemon=True)
        self._in_doubt = False  # whether the last renewal failed
        self._started: Callable[[], None] = _nothing
        self._stopped: Callable[[], None] = _nothing
        self._renewed: Callable[[], None] = _nothing

    def start(
        self,
        started: Callable[[], None] = _nothing,
        stopped: Callable[[], None] = _nothing,
        renewed: Callable[[], None] = _nothing,
    ) -> None:
        """Join the election; call it once.

        Args:
            started: called when this process becomes the leader; the function must return soon.
            stopped: called when this process is no longer the leader. `leads()` may have become False some
                time before.
            renewed: called when a renewal succeeds after a failed renewal in the same term. Work that was
                refused after the failure can be done now. The function must return soon.
        """
        self._started, self._stopped, self._renewed = started, stopped, renewed
        self._thread.start()

    def stop(self, deadline_s: float = 2.0) -> None:
        """Stop leading, and release the Lease so that another candidate can take it at once.

        `leads()` returns False from now on, so stop all writers first. If the release takes longer than
        `deadline_s`, the Lease expires instead.
        """
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join(deadline_s)

    def leads(self) -> bool:
        """Return whether this process may act as the leader now."""
        tenure = self._tenure
        return tenure is not None and not self._stopping.is_set() and tenure.holds(time.monotonic())

    def term(self) -> int | None:
        """Return the number of the current term, from 1; None if this process may not act as the leader.

        Do not execute the decisions of one term in a later term: another process may have led in between.
        """
        term = self._terms
        return term if self.leads() else None

    def _run(self) -> None:
        while True:
            try:
                self._turn()
            except ApiError as error:
                self._in_doubt = True
                log.warning("lease not renewed", lease=self._name, reason=error.reason, error=str(error))
            if self._tenure is not None and not self._tenure.holds(time.monotonic()):
                self._lose()
            if self._stopping.wait(self._renew_s):
                self._release()
                return

    def _turn(self) -> None:
        """Renew the Lease, or take it if it is free."""
        sent = time.monotonic()
        try:
            if self._tenure is not None:
                self._write(sent, {})
                return
            found = self._api.get(LEASES, self._namespace, self._name)
        except NotFound:
            self._create(sent)
            return
        # Another process wrote the Lease, or this process wrote it but did not receive the response.
        except Conflict:
            found = self._api.get(LEASES, self._namespace, self._name)
        claim = LeaseSpec.read(found)
        self._version = str(found["metadata"]["resourceVersion"])
        self._sighting.see(claim, time.monotonic())
        ours = claim.holder == self._identity
        if self._tenure is not None and not ours:
            self._lose()
        elif ours or self._sighting.free(time.monotonic()):
            self._take(claim, ours=ours)

    def _take(self, claim: LeaseSpec, *, ours: bool) -> None:
        change: dict[str, Any] = {}
        if not ours:
            change = {"acquireTime": _now(), "leaseTransitions": claim.transitions + 1}
        try:
            self._write(time.monotonic(), change)
        except Conflict:
            log.info("lease taken by another", lease=self._name)

    def _create(self, sent: float) -> None:
        lease = {
            "apiVersion": LEASES.api_version,
            "kind": LEASES.kind,
            "metadata": {"name": self._name, "namespace": self._namespace},
            "spec": {**self._spec(), "acquireTime": _now(), "leaseTransitions": 0},
        }
        try:
            self._hold(sent, self._api.create(LEASES, lease))
        except AlreadyExists:
            log.info("lease taken by another", lease=self._name)

    def _write(self, sent: float, change: dict[str, Any]) -> None:
        patch = {"spec": {**self._spec(), **change}}
        written = self._api.merge(LEASES, self._namespace, self._name, patch, resource_version=self._version)
        self._hold(sent, written)

    def _spec(self) -> dict[str, Any]:
        return {
            "holderIdentity": self._identity,
            "leaseDurationSeconds": max(1, round(self._duration_s)),
            "renewTime": _now(),
        }

    def _hold(self, sent: float, written: Object) -> None:
        first = self._tenure is None
        self._terms += first
        self._version = str(written["metadata"]["resourceVersion"])
        self._tenure = Tenure(sent=sent, duration_s=self._duration_s)
        after_doubt, self._in_doubt = self._in_doubt, False
        if first:
            log.info("leads", lease=self._name, identity=self._identity)
            self._started()
        elif after_doubt:
            self._renewed()

    def _lose(self) -> None:
        self._tenure = None
        log.warning("no longer leads", lease=self._name, identity=self._identity)
        self._stopped()

    def _release(self) -> None:
        if self._tenure is None:
            return
        self._lose()
        patch = {"spec": {"holderIdentity": "", "leaseDurationSeconds": 1, "renewTime": _now()}}
        try:
            self._api.merge(LEASES, self._namespace, self._name, patch, resource_version=self._version)
        except ApiError as error:
            log.warning("lease not released", lease=self._name, error=str(error))


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")
