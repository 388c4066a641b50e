"""The clocks of one look at a job, and what this process found when it looked before.

No two clocks agree: a node's may be minutes off, and an operator's own may be set. So a wait is counted on
this process's monotonic clock, from the look that first found it. A restart or a new leader begins every
wait anew: it gets longer, never shorter. The wall clock stamps a status; only the time to live is read
from it, by a stamp of the operator's own.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime

from palaestra.decide.conditions import Told

WaitKey = tuple[int | str, ...]  # the replica, what is waited for, and what would make it another wait


@dataclass(frozen=True, slots=True, kw_only=True)
class Wait:
    """Something that may take so long.

    Attributes:
        key: what is waited for, within a replica; a wait of another key begins anew.
        seconds: that it may take.
        begun_s: when it began, on the monotonic clock, where something says; None: at its first sight.
    """

    key: tuple[str, ...]
    seconds: float
    begun_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """What keeps a replica from its first step.

    Attributes:
        told: the reason and its message.
        gone_s: the first look that did not find it any more, on the monotonic clock; None: it is there.
    """

    told: Told
    gone_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """What one look leaves to the next one of the same process; nobody needs it to go on.

    Attributes:
        waits: when each wait that goes on was first found, on the monotonic clock.
        troubles: by replica, while it waits for its first step.
        active_s: seconds that the job was active, as far as this process knows.
        active_at_s: until when they are counted; None: the job is not active.
    """

    waits: Mapping[WaitKey, float] = field(default_factory=dict)
    troubles: Mapping[int, Trouble] = field(default_factory=dict)
    active_s: float = 0.0
    active_at_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Times:
    """The clocks at one look.

    Attributes:
        now: the wall clock, with a time zone.
        clock_s: the monotonic clock of this process.
        record: what the last look left.
    """

    now: datetime
    clock_s: float
    record: Record = field(default_factory=Record)

    def since_s(self, replica: int, wait: Wait) -> float:
        """Return since when a wait of a replica goes on."""
        begun_s = self.clock_s if wait.begun_s is None else min(wait.begun_s, self.clock_s)
        return self.record.waits.get((replica, *wait.key), begun_s)

    def active_s(self, written_s: int) -> float:
        """Return how long the job was active; `written_s`: as its status has it."""
        record = self.record
        elapsed_s = 0.0 if record.active_at_s is None else self.clock_s - record.active_at_s
        return max(float(written_s), record.active_s + elapsed_s)
