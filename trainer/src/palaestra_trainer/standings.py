"""How each simulator of a run stands, and what the last faults were. Not locked: `Progress` is."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from palaestra_sim.protocol.status import MOST_FAULTS, FaultKind, FaultRecord, SimulatorStatus
from palaestra_trainer.configuration import Role
from palaestra_trainer.families import RECYCLED

FLAPPING_S = 600.0  # a simulator that nobody has called flapping for so long is steady again
AskStandby = Callable[[], str | None]


def _none() -> None:
    """Return the state of a spare that isn't there."""


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


class Standings:
    """What is known of the simulators in this attempt.

    Attributes:
        faults: the last ones, the newest last.
    """

    def __init__(self, simulators: Iterable[tuple[str, Role]], clock: Callable[[], float]) -> None:
        self._clock = clock
        self._all = {name: _Standing(role=role) for name, role in simulators}
        self.faults: deque[FaultRecord] = deque(maxlen=MOST_FAULTS)

    def broke(self, fault: FaultRecord) -> None:
        """A simulator is down from now on."""
        self.faults.append(fault)
        standing = self._all[fault.simulator]
        standing.state, standing.last_fault, standing.last_kind = "failed", fault.fact, fault.kind
        standing.faults[fault.kind] += 1

    def was_slow(self, simulator: str) -> None:
        """Count a slow step of a simulator."""
        self._all[simulator].faults[FaultKind.SLOW] += 1

    def is_up(self, simulator: str) -> None:
        """A simulator is up from now on."""
        self._all[simulator].state = "ready"

    def restarted(self, simulator: str) -> None:
        """Count a restart of a simulator, which mended its last fault."""
        standing = self._all[simulator]
        standing.restarts[standing.last_kind] += 1

    def recycled(self, simulator: str) -> None:
        """Count a restart of a healthy simulator."""
        self._all[simulator].recycled += 1

    def flaps(self, simulator: str) -> None:
        """A simulator breaks again and again."""
        self._all[simulator].flapped = self._clock()

    def gave_up(self, simulator: str) -> None:
        """A simulator won't come back."""
        standing = self._all[simulator]
        standing.state, standing.given_up = "failed", True

    def has_standby(self, simulator: str, ask: AskStandby) -> None:
        """Let `ask`, which any thread may call, tell how the simulator's spare is."""
        self._all[simulator].standby = ask

    def restarts(self) -> int:
        """Return the restarts after faults of all simulators."""
        return sum(standing.restarts.total() for standing in self._all.values())

    def down(self) -> list[str]:
        """Return the names of those that are not up, but for those that were given up."""
        return [name for name, each in self._all.items() if each.state != "ready" and not each.given_up]

    def statuses(self) -> tuple[SimulatorStatus, ...]:
        """Return what /status tells of each."""
        return tuple(self._status(name, standing) for name, standing in self._all.items())

    def faults_by_kind(self) -> dict[tuple[str, ...], int]:
        """Return how many faults each simulator had of each kind."""
        return {
            (name, kind.value): standing.faults[kind]
            for name, standing in self._all.items()
            for kind in FaultKind
        }

    def restarts_by_cause(self) -> dict[tuple[str, ...], int]:
        """Return how often each simulator was restarted, by the fault that it mended, or for its wear."""
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
