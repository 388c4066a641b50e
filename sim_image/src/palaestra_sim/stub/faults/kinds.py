"""What can go wrong in a simulator, as data; docs/simulators.md tells what each looks like to a client."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from signal import Signals

STEP_PATH = "robot/time_step"
RESET_PATHS = frozenset(
    f"supervisor/{name}" for name in ("simulation_reset", "simulation_revert", "world_reload")
)


class Event(StrEnum):
    """Events that are counted, from 1, in each life of a stub; the program that starts it counts the lives.

    step: a `time_step` request of the robot that asked first: once a step, however many robots.
    reset: a request for the start of the world. call: one of a service that the fault names.
    """

    STEP = "step"
    RESET = "reset"
    CALL = "call"
    START = "start"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """At which events a fault happens: at one, at every n-th, at a share of them, or at all.

    Attributes:
        event: which events.
        at: the only one; None: see the others.
        every: each multiple of this.
        probability: of each.
    """

    event: Event
    at: int | None = None
    every: int = 1
    probability: float = 1.0

    def fires(self, number: int, draw: float) -> bool:
        """Say whether the fault happens at that event, counted from 1; `draw` is even in [0, 1)."""
        if self.at is not None:
            return number == self.at
        return number % self.every == 0 and draw < self.probability


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Something that goes wrong.

    Attributes:
        text: as it was written.
        trigger: when.
        service: the services it is about, below the robot's name, `*` for anything; "": none.
        topic: the topics it is about, in the same way.
    """

    text: str
    trigger: Trigger
    service: str = ""
    topic: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Crash(Fault):
    """The process is ended by a signal, with the request unanswered."""

    signal: Signals = Signals.SIGSEGV


@dataclass(frozen=True, slots=True, kw_only=True)
class Exit(Fault):
    """The process ends in good order, too early."""

    code: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hang(Fault):
    """The process stops with its sockets open; or one service never answers again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Delayed(Fault):
    """Something comes later: by the latency, and by up to the jitter on top of it."""

    latency_s: float = 0.0
    jitter_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Slow(Delayed):
    """A step, a reset, or calls of a service take longer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Late(Delayed):
    """Messages of a step come later than its answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost(Fault):
    """Messages of a step never come."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongValue(Fault):
    """Numbers with a fraction become another one."""

    value: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongShape(Fault):
    """The second half of the bytes is missing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryGrowth(Fault):
    """Memory is taken and never given back, until there is `most_mib` of it."""

    mib: float = 1.0
    most_mib: float = 1024.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StartRefused(Fault):
    """The process ends before it has registered anything."""

    code: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowStart(Delayed):
    """Nothing is registered for a while."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MasterLost(Fault):
    """The stub ends as it does when the ROS master is gone; its names stay, and lead nowhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamesLost(Fault):
    """The master forgets the stub, as one does that was restarted; connections go on."""
