"""The arithmetic of a Lease: when a leader must stop, and when another may start. The clock is an argument.

Each process compares durations on its own monotonic clock; the times in a Lease are only for people. A
follower counts from the time at which it *saw* the last renewal, which is after the write. A leader counts
from the time at which it *sent* the renewal, which is before the write. The leader stops after two thirds of
the duration. So a leader has stopped before another leader starts, as long as their clocks run at similar
speeds (faster than two thirds of each other).
"""

from dataclasses import dataclass, field

from palaestra.objects import Object

# A leader acts for this share of a Lease's duration; the remaining time is for writes in flight.
SHARE = 2 / 3


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaseSpec:
    """The spec of a Lease.

    Attributes:
        holder: identity of the leader; "" without a leader.
        duration_s: seconds without a renewal after which another candidate may take the Lease.
        renewed: time of the last renewal by the leader's clock. This time is compared only with earlier
            values of the Lease, never with a clock.
        transitions: number of changes of the leader.
    """

    holder: str = ""
    duration_s: float = 0.0
    renewed: str = ""
    transitions: int = 0

    @classmethod
    def read(cls, lease: Object) -> "LeaseSpec":
        """Return the spec of a Lease object; an absent field is "" or 0."""
        spec = lease.get("spec") or {}
        return cls(
            holder=str(spec.get("holderIdentity") or ""),
            duration_s=float(spec.get("leaseDurationSeconds") or 0),
            renewed=str(spec.get("renewTime") or ""),
            transitions=int(spec.get("leaseTransitions") or 0),
        )


@dataclass(slots=True)
class ObservedLease:
    """A follower's view of the Lease: its last spec, and the time at which the follower first saw it."""

    claim: LeaseSpec = field(default_factory=LeaseSpec)
    since: float = float("-inf")

    def see(self, claim: LeaseSpec, now: float) -> None:
        """Record the current spec of the Lease."""
        if claim != self.claim:
            self.claim, self.since = claim, now

    def free(self, now: float) -> bool:
        """Return whether a candidate may take the Lease: it has no holder, or was not renewed in time."""
        return not self.claim.holder or now >= self.since + self.claim.duration_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Tenure:
    """A leader's own view: the time at which it sent the last successful renewal.

    Attributes:
        sent: seconds on the leader's clock, just before the request.
        duration_s: `leaseDurationSeconds` of the Lease.
    """

    sent: float
    duration_s: float

    def holds(self, now: float) -> bool:
        """Return whether the leader may still act. False comes before another process may take the Lease."""
        return now < self.sent + self.duration_s * SHARE
