"""Decide which faults affect each request and message, in one run of the simulator's process (a life).

Pure: this module only counts events, and uses no socket, process or clock. If a fault names a service and
its trigger is a step or a reset, the service has the fault from that event to the end of the process. A
service that hangs also stays hung until the end of the process.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from fnmatch import fnmatchcase

from palaestra_sim.faults.kinds import (
    RESET_PATHS,
    STEP_PATH,
    FaultEvent,
    Hang,
    InjectedFault,
    Late,
    Lost,
    Slow,
    SlowStart,
    StartRefused,
    WrongShape,
    WrongValue,
)
from palaestra_sim.faults.schedule import FaultSchedule

Damage = WrongValue | WrongShape


@dataclass(frozen=True, slots=True, kw_only=True)
class Ruling:
    """The decision about a request or a message.

    Attributes:
        lost: whether the request or message is dropped.
        delay_s: the delay of the request or message, in seconds.
        damages: the changes to the response or the message.
        effects: the faults of the process, which occur before the request is handled, in this order.
    """

    lost: bool = False
    delay_s: float = 0.0
    damages: tuple[Damage, ...] = ()
    effects: tuple[InjectedFault, ...] = ()


UNHARMED = Ruling()


class FaultState:
    """Counts the events of this life; decides from the counts and the schedule which faults occur."""

    def __init__(self, schedule: FaultSchedule) -> None:
        self._schedule = schedule
        self._counts: Counter[FaultEvent] = Counter()
        self._calls: Counter[InjectedFault] = Counter()
        self._stepping: str | None = None
        self._lasting: set[InjectedFault] = set()
        self._messages: tuple[InjectedFault, ...] = ()

    @property
    def schedule(self) -> FaultSchedule:
        """The schedule of the faults in this life."""
        return self._schedule

    def start(self) -> tuple[StartRefused | None, float]:
        """Return the fault that prevents the start, if any, and the delay of the start."""
        number = self._schedule.life.number
        found = self._schedule.at(FaultEvent.START, number)
        refused = next((finding for finding in found if isinstance(finding, StartRefused)), None)
        delays = (
            self._schedule.delay_s(finding, number) for finding in found if isinstance(finding, SlowStart)
        )
        return refused, sum(delays)

    def request(self, robot: str, path: str) -> Ruling:
        """Return the decision about a request to `path`, which is relative to the robot's name."""
        delay_s, effects = 0.0, []
        number, faults = self._count(robot, path)
        for fault in faults:
            if fault.service:
                self._lasting.add(fault)
            elif isinstance(fault, Slow):
                delay_s += self._schedule.delay_s(fault, number)
            elif not fault.topic:
                effects.append(fault)
        return self._with_service_faults(path, delay_s, tuple(effects))

    def message(self, path: str) -> Ruling:
        """Return the decision about a message; `path` is its topic, relative to the robot or global (`/`)."""
        number = self._counts[FaultEvent.STEP]
        faults = [message for message in self._messages if _matches(path, message.topic)]
        if not faults:
            return UNHARMED
        return Ruling(
            lost=any(isinstance(fault, Lost) for fault in faults),
            delay_s=sum(self._schedule.delay_s(fault, number) for fault in faults if isinstance(fault, Late)),
            damages=tuple(fault for fault in faults if isinstance(fault, Damage)),
        )

    def closed(self, robot: str) -> None:
        """Record that a robot's controller has ended.

        If the steps of this robot were counted, the steps of another robot are counted from now on.
        """
        if self._stepping == robot:
            self._stepping = None

    def _count(self, robot: str, path: str) -> tuple[int, tuple[InjectedFault, ...]]:
        """Count the step or reset that a request starts; return its number and the faults that occur at it.

        Return 0 and no faults for any other request.
        """
        event = FaultEvent.RESET if path in RESET_PATHS else None
        if path == STEP_PATH:
            self._stepping = self._stepping or robot
            event = FaultEvent.STEP if robot == self._stepping else None
        if event is None:
            return 0, ()
        self._counts[event] += 1
        number = self._counts[event]
        faults = self._schedule.at(event, number)
        if event is FaultEvent.STEP:
            self._messages = tuple(it for it in faults if it.topic)
        return number, faults

    def _with_service_faults(self, path: str, delay_s: float, effects: tuple[InjectedFault, ...]) -> Ruling:
        lost, damages = False, []
        for fault in self._schedule.faults:
            if fault.service and _matches(path, fault.service) and self._befalls(fault):
                lost |= isinstance(fault, Hang)
                if isinstance(fault, Slow):
                    delay_s += self._schedule.delay_s(fault, self._calls[fault])
                elif isinstance(fault, Damage):
                    damages.append(fault)
        return Ruling(lost=lost, delay_s=delay_s, damages=tuple(damages), effects=effects)

    def _befalls(self, fault: InjectedFault) -> bool:
        """Count a call of a service that `fault` names; return whether the fault occurs at this call."""
        self._calls[fault] += 1
        if fault.trigger.event is FaultEvent.CALL and self._schedule.happens(fault, self._calls[fault]):
            if isinstance(fault, Hang):
                self._lasting.add(fault)
            return True
        return fault in self._lasting


def _matches(path: str, pattern: str) -> bool:
    """Return whether a pattern with `*` matches a path; a global pattern matches only global paths."""
    return path.startswith("/") == pattern.startswith("/") and fnmatchcase(path, pattern)
