"""Who may lead, and until when: the arithmetic of a Lease, with the time passed in.

Only durations are compared, on each one's own clock that never goes back; the times in a Lease are for
people. A follower counts from the moment when it *saw* the last renewal, which is after it was written. A
leader counts from the moment when it *sent* it, which is before, and stops at two thirds. So a leader has
stopped before anyone else can start, unless a clock runs at two thirds of another's speed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

SHARE = 2 / 3  # of a lease's duration that its leader uses; the rest is for writes that are on their way


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """What a Lease says.

    Attributes:
        holder: identity of the leader; "" for nobody.
        duration_s: seconds without a renewal after which others may take it.
        renewed: the leader's word for when it renewed; compared for being the same, never as a time.
        transitions: how many times the lease has passed on.
    """

    holder: str = ""
    duration_s: float = 0.0
    renewed: str = ""
    transitions: int = 0

    @classmethod
    def read(cls, lease: Mapping[str, Any]) -> "Claim":
        """Return what a Lease object says; what it leaves out is nobody's and 0."""
        spec = lease.get("spec") or {}
        return cls(
            holder=str(spec.get("holderIdentity") or ""),
            duration_s=float(spec.get("leaseDurationSeconds") or 0),
            renewed=str(spec.get("renewTime") or ""),
            transitions=int(spec.get("leaseTransitions") or 0),
        )


@dataclass(slots=True)
class Sighting:
    """What a follower saw of another's lease, and when it last saw a change."""

    claim: Claim = field(default_factory=Claim)
    since: float = float("-inf")

    def see(self, claim: Claim, now: float) -> None:
        """Take notice of what the Lease says now."""
        if claim != self.claim:
            self.claim, self.since = claim, now

    def free(self, now: float) -> bool:
        """Whether the lease may be taken: nobody has it, or it was not renewed for its whole duration."""
        return not self.claim.holder or now >= self.since + self.claim.duration_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Tenure:
    """A leader's own: when it sent the renewal that succeeded last.

    Attributes:
        sent: on the leader's clock, before the request went out.
        duration_s: of the lease.
    """

    sent: float
    duration_s: float

    def holds(self, now: float) -> bool:
        """Whether the leader may still act; false before anybody else may."""
        return now < self.sent + self.duration_s * SHARE
