"""The arithmetic of a Lease: when a leader stops and when another may start. The time is passed in.

Each process compares durations on its own monotonic clock; the times in a Lease are for people. A follower
counts from the moment when it *saw* the last renewal, which is after the write. A leader counts from the
moment when it *sent* the renewal, which is before the write, and stops at two thirds. So a leader has stopped
before another starts, unless one clock runs at two thirds of the other's speed.
"""

from dataclasses import dataclass, field

from palaestra.objects import Object

SHARE = 2 / 3  # of a lease's duration, for its leader; the rest is for writes that are in flight


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaseSpec:
    """The spec of a Lease.

    Attributes:
        holder: identity of the leader; "" without a leader.
        duration_s: seconds without a renewal after which others may take it.
        renewed: the leader's time of the last renewal; compared for equality only, never with a clock.
        transitions: how often the leader has changed.
    """

    holder: str = ""
    duration_s: float = 0.0
    renewed: str = ""
    transitions: int = 0

    @classmethod
    def read(cls, lease: Object) -> "LeaseSpec":
        """Return the claim in a Lease object; an absent field is "" or 0."""
        spec = lease.get("spec") or {}
        return cls(
            holder=str(spec.get("holderIdentity") or ""),
            duration_s=float(spec.get("leaseDurationSeconds") or 0),
            renewed=str(spec.get("renewTime") or ""),
            transitions=int(spec.get("leaseTransitions") or 0),
        )


@dataclass(slots=True)
class ObservedLease:
    """A follower's view of the lease: the last claim, and when the follower saw it change."""

    claim: LeaseSpec = field(default_factory=LeaseSpec)
    since: float = float("-inf")

    def see(self, claim: LeaseSpec, now: float) -> None:
        """Record the claim that the Lease has now."""
        if claim != self.claim:
            self.claim, self.since = claim, now

    def free(self, now: float) -> bool:
        """Return whether the lease may be taken: it has no holder, or was not renewed for its duration."""
        return not self.claim.holder or now >= self.since + self.claim.duration_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Tenure:
    """A leader's own view: when it sent the last successful renewal.

    Attributes:
        sent: on the leader's clock, just before the request.
        duration_s: of the lease.
    """

    sent: float
    duration_s: float

    def holds(self, now: float) -> bool:
        """Return whether the leader may still act; false before another may."""
        return now < self.sent + self.duration_s * SHARE
