"""Plans: each disturbs one request of one workload with one fault. A number always means the same plan.

The plans of a workload are numbered. First each row of `ROWS` disturbs the first request of its kind, then
the second, and so on. If a workload sends fewer requests, the plan disturbs nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from tests.faults.requests import ANSWER, CHANGE, EVENT, GET, LIST, WATCH, WRITE


class Kind(StrEnum):
    """The kind of a fault."""

    KILL_BEFORE = "kill before"
    """The operator is killed, and the API server never gets the request."""

    KILL_AFTER = "kill after"
    """The API server executes the request, and the operator is killed before it gets the response."""

    DROP = "drop the answer"
    """The API server executes the request, and the connection closes without a response."""

    CONFLICT = "409"
    """The API server reports that another client changed the object first."""

    GONE = "410"
    """The API server no longer has the requested version, or the rest of a list."""

    BUSY = "429"
    """The API server reports too many requests, and permits the next one after 0 seconds."""

    ERROR = "500"
    """The API server reports an internal error."""

    UNAVAILABLE = "503"
    """The API server, or a proxy in front of it, serves no requests."""

    CUT = "cut the watch"
    """The watch ends in the middle of an event."""

    FREEZE = "freeze the watch"
    """The watch is silent for some seconds, so the operator's cache is stale; then the watch continues."""

    DELAY = "delay"
    """The request reaches the API server some seconds later."""

    AWAY = "away"
    """For some seconds every connection is closed, including connections of watches."""

    SLOW = "trainer answers slowly"
    """The response arrives byte by byte, for a minute."""

    HALF = "trainer answers half"
    """The connection closes in the middle of the response."""

    LIES = "trainer lies"
    """The response contains impossible numbers and times."""

    MUCH = "trainer answers too much"
    """The response does not end."""


CODES = {Kind.CONFLICT: 409, Kind.GONE: 410, Kind.BUSY: 429, Kind.ERROR: 500, Kind.UNAVAILABLE: 503}
TRAINERS = frozenset({Kind.SLOW, Kind.HALF, Kind.LIES, Kind.MUCH})
KILLS = frozenset({Kind.KILL_BEFORE, Kind.KILL_AFTER})
LATE_S = 11.0  # longer than the operator waits for a response


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One fault.

    Attributes:
            kind: the kind of the fault.
            request: the kind of the request that gets the fault.
            number: the number, from 1, of the request among those of its kind.
            seconds: the duration of the fault; 0 if the fault has none.
    """

    kind: Kind
    request: str
    number: int
    seconds: float = 0.0

    @property
    def words(self) -> str:
        """The fault as text: `kill after write 3`."""
        lasting = f" for {self.seconds:g} s" if self.seconds else ""
        return f"{self.kind} at {self.request} {self.number}{lasting}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A workload and the fault of one of its requests; `seed` identifies both."""

    seed: int
    workload: str
    fault: Fault

    @property
    def words(self) -> str:
        """The plan as text."""
        return f"{self.seed}: {self.workload}, {self.fault.words}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A kind of fault for a kind of request: for every `stride`-th request, beginning with `first`."""

    kind: Kind
    request: str
    seconds: float = 0.0
    stride: int = 1
    first: int = 1


# Every write gets two faults. After a fault of the first four rows, the write has succeeded, but the operator
# does not know it. After a fault of the next six rows, the write has failed. Reads get fewer faults, because
# the operator repeats reads.
ROWS = (
    Row(kind=Kind.KILL_AFTER, request=WRITE, stride=2, first=1),
    Row(kind=Kind.DROP, request=WRITE, stride=4, first=2),
    Row(kind=Kind.DELAY, request=WRITE, seconds=2.0, stride=8, first=4),
    Row(kind=Kind.DELAY, request=WRITE, seconds=LATE_S, stride=8, first=8),
    Row(kind=Kind.KILL_BEFORE, request=WRITE, stride=6, first=1),
    Row(kind=Kind.CONFLICT, request=WRITE, stride=6, first=2),
    Row(kind=Kind.BUSY, request=WRITE, stride=6, first=3),
    Row(kind=Kind.ERROR, request=WRITE, stride=6, first=4),
    Row(kind=Kind.UNAVAILABLE, request=WRITE, stride=6, first=5),
    Row(kind=Kind.AWAY, request=WRITE, seconds=3.0, stride=6, first=6),
    Row(kind=Kind.FREEZE, request=CHANGE, seconds=3.0, stride=4),
    Row(kind=Kind.CUT, request=CHANGE, stride=8),
    Row(kind=Kind.GONE, request=CHANGE, stride=12),
    Row(kind=Kind.GONE, request=WATCH),
    Row(kind=Kind.UNAVAILABLE, request=WATCH),
    Row(kind=Kind.GONE, request=LIST),
    Row(kind=Kind.DROP, request=LIST),
    Row(kind=Kind.ERROR, request=GET),
    Row(kind=Kind.AWAY, request=GET, seconds=12.0),
    Row(kind=Kind.KILL_BEFORE, request=EVENT, stride=4),
    Row(kind=Kind.DROP, request=EVENT, stride=4, first=3),
    Row(kind=Kind.SLOW, request=ANSWER),
    Row(kind=Kind.HALF, request=ANSWER),
    Row(kind=Kind.LIES, request=ANSWER),
    Row(kind=Kind.MUCH, request=ANSWER),
)


def plan(seed: int, workloads: Sequence[str]) -> Plan:
    """Return the plan of a number from 0; the rows of each workload begin at a different request."""
    rest, workload = divmod(seed, len(workloads))
    turn, row_number = divmod(rest, len(ROWS))
    row = ROWS[row_number]
    number = 1 + (row.first - 1 + workload) % row.stride + turn * row.stride
    fault = Fault(kind=row.kind, request=row.request, number=number, seconds=row.seconds)
    return Plan(seed=seed, workload=workloads[workload], fault=fault)


def plans(counts: Mapping[str, Mapping[str, int]]) -> Iterator[Plan]:
    """Yield every plan that disturbs a request; `counts` has each workload's requests by kind."""
    workloads = tuple(counts)
    most = max((number for each in counts.values() for number in each.values()), default=0)
    for seed in range(most * len(ROWS) * len(workloads)):
        found = plan(seed, workloads)
        if found.fault.number <= counts[found.workload].get(found.fault.request, 0):
            yield found
