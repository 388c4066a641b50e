"""Keep the state of each simulator and the last faults; the caller, `Progress`, holds a lock."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from palaestra_protocol.pod.enums import Role
from palaestra_protocol.pod.status import MOST_FAULTS, FaultKind, FaultRecord, SimulatorStatus
from palaestra_trainer.run.telemetry.metric_definitions import RECYCLED

FLAPPING_S = 600.0  # time after the last call of `flaps` in which a simulator counts as flapping
AskStandby = Callable[[], str | None]
AskLeftOut = Callable[[], tuple[str, ...]]


def _none() -> None:
    """Return None, the state of the standby for a simulator without a standby."""


def _nothing() -> tuple[str, ...]:
    """Return no left-out parts, for a simulator that does not report them."""
    return ()


@dataclass(slots=True)
class _Standing:
    role: Role
    state: str = "starting"
    faults: Counter[str] = field(default_factory=Counter)
    restarts: Counter[str] = field(default_factory=Counter)
    last_kind: str = FaultKind.DEAD
    recycled: int = 0
    last_fault: str | None = None
    flapped: float | None = None
    given_up: bool = False
    standby: AskStandby = _none
    left_out: AskLeftOut = _nothing


class SimulatorStatuses:
    """The states of all simulators in this attempt.

    Attributes:
        faults: the last faults, the newest last.
    """

    def __init__(self, simulators: Iterable[tuple[str, Role]], clock: Callable[[], float]) -> None:
        self._clock = clock
        self._all = {name: _Standing(role=role) for name, role in simulators}
        self.faults: deque[FaultRecord] = deque(maxlen=MOST_FAULTS)

    def add(self, simulator: str, role: Role) -> None:
        """Add a simulator, unless it is already known."""
        self._all.setdefault(simulator, _Standing(role=role))

    def broke(self, fault: FaultRecord) -> None:
        """Record a fault and mark its simulator as down."""
        self.faults.append(fault)
        standing = self._all[fault.simulator]
        standing.state, standing.last_fault, standing.last_kind = "failed", fault.fact, fault.kind
        standing.faults[fault.kind] += 1

    def was_slow(self, simulator: str) -> None:
        """Count a slow step of a simulator."""
        self._all[simulator].faults[FaultKind.SLOW] += 1

    def is_up(self, simulator: str) -> None:
        """Mark a simulator as up."""
        self._all[simulator].state = "ready"

    def restarted(self, simulator: str) -> None:
        """Count a restart of a simulator under the kind of its last fault."""
        standing = self._all[simulator]
        standing.restarts[standing.last_kind] += 1

    def recycled(self, simulator: str) -> None:
        """Count a restart of a healthy simulator."""
        self._all[simulator].recycled += 1

    def flaps(self, simulator: str) -> None:
        """Mark a simulator that fails repeatedly as flapping."""
        self._all[simulator].flapped = self._clock()

    def gave_up(self, simulator: str) -> None:
        """Mark a simulator as given up."""
        standing = self._all[simulator]
        standing.state, standing.given_up = "failed", True

    def has_standby(self, simulator: str, ask: AskStandby) -> None:
        """Set the function, called by any thread, that returns the state of the simulator's standby."""
        self._all[simulator].standby = ask

    def reports_left_out(self, simulator: str, ask: AskLeftOut) -> None:
        """Set the function, called by any thread, that returns the parts that the simulator left out."""
        self._all[simulator].left_out = ask

    def left_out(self) -> tuple[str, ...]:
        """Return the left-out parts of one simulator per group, because a group has one world."""
        reports: dict[str, tuple[str, ...]] = {}
        for name, standing in self._all.items():
            group = name.rpartition("-")[0]
            reports[group] = reports.get(group) or standing.left_out()
        return tuple(f"{group}: {line}" for group, lines in reports.items() for line in lines)

    def restarts(self) -> int:
        """Return the number of restarts after faults, of all simulators together."""
        return sum(standing.restarts.total() for standing in self._all.values())

    def down(self) -> list[str]:
        """Return the names of the simulators that are not up, except those that were given up."""
        return [name for name, each in self._all.items() if each.state != "ready" and not each.given_up]

    def statuses(self) -> tuple[SimulatorStatus, ...]:
        """Return the status of each simulator for /status."""
        return tuple(self._status(name, standing) for name, standing in self._all.items())

    def faults_by_kind(self) -> dict[tuple[str, ...], int]:
        """Return the number of faults by simulator and kind."""
        return {
            (name, kind.value): standing.faults[kind]
            for name, standing in self._all.items()
            for kind in FaultKind
        }

    def restarts_by_cause(self) -> dict[tuple[str, ...], int]:
        """Return the number of restarts by simulator and cause: a kind of fault, or recycling."""
        mended: dict[tuple[str, ...], int] = {
            (name, kind.value): standing.restarts[kind]
            for name, standing in self._all.items()
            for kind in FaultKind
            if kind is not FaultKind.SLOW
        }
        return mended | {(name, RECYCLED): standing.recycled for name, standing in self._all.items()}

    def _status(self, name: str, standing: _Standing) -> SimulatorStatus:
        flapped = standing.flapped
        return SimulatorStatus(
            name=name,
            role=standing.role,
            state=standing.state,
            restarts=standing.restarts.total(),
            last_fault=standing.last_fault,
            flapping=flapped is not None and self._clock() - flapped < FLAPPING_S,
            given_up=standing.given_up,
            standby=standing.standby(),
        )
