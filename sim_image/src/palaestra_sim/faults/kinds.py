"""The kinds of faults, as data; docs/reference/faults.md describes the effect of each on a client."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from signal import Signals

STEP_PATH = "robot/time_step"
RESET_PATHS = frozenset(
    f"supervisor/{name}" for name in ("simulation_reset", "simulation_revert", "world_reload")
)


class FaultEvent(StrEnum):
    """Events that are counted, from 1, in each life of a stub; the parent program counts the lives.

    - step: a `time_step` request of the first robot that sent one, so one event a step for any number of
    robots.
    - reset: a request for a reset of the world.
    - call: a call of a service that the fault names.
    """

    STEP = "step"
    RESET = "reset"
    CALL = "call"
    START = "start"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """The events at which a fault occurs: one, every n-th, a random share of them, or all.

    Attributes:
        event: the kind of events.
        at: the number of the only event; None if another attribute decides.
        every: the fault occurs at each multiple of this.
        probability: the probability of the fault at each event.
    """

    event: FaultEvent
    at: int | None = None
    every: int = 1
    probability: float = 1.0

    def fires(self, number: int, draw: float) -> bool:
        """Return whether the fault occurs at event `number`, counted from 1; `draw` is uniform in [0, 1)."""
        if self.at is not None:
            return number == self.at
        return number % self.every == 0 and draw < self.probability


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """A fault.

    Attributes:
        text: as it was written.
        trigger: the events at which it occurs.
        service: the affected services, relative to the robot, `*` for anything; "" for no service.
        topic: the affected topics, in the same form.
    """

    text: str
    trigger: Trigger
    service: str = ""
    topic: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Crash(InjectedFault):
    """A signal terminates the process, without a response to the request."""

    signal: Signals = Signals.SIGSEGV


@dataclass(frozen=True, slots=True, kw_only=True)
class Exit(InjectedFault):
    """The process closes everything and exits too early."""

    code: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hang(InjectedFault):
    """The process stops with its sockets open, or one service never responds again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Delayed(InjectedFault):
    """A delay: the latency, plus a random share of the jitter."""

    latency_s: float = 0.0
    jitter_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Slow(Delayed):
    """A step, a reset, or calls of a service take longer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Late(Delayed):
    """Messages of a step arrive after its response."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost(InjectedFault):
    """Messages of a step are dropped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongValue(InjectedFault):
    """Floats have another value."""

    value: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongShape(InjectedFault):
    """The second half of the bytes is missing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryGrowth(InjectedFault):
    """Memory is allocated and never freed, up to `most_mib`."""

    mib: float = 1.0
    most_mib: float = 1024.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StartRefused(InjectedFault):
    """The process exits before it has registered any name."""

    code: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowStart(Delayed):
    """The stub registers its names late."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MasterLostFault(InjectedFault):
    """The stub ends as if the ROS master were gone; its names stay registered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamesLost(InjectedFault):
    """The master forgets the stub, like a restarted master; connections stay open."""
