"""The kinds of faults, as data; docs/reference/faults.md describes the effect of each kind on a client."""

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
    """The events that trigger faults.

    A life is one run of the stub's process. In each life, the events of each kind are counted from 1.

    - step: a `time_step` request of the robot that sent the first such request. So each step is one event,
      even in a world with several robots.
    - reset: a request for a reset of the world.
    - call: a call of a service that the fault names.
    - start: a start of the stub. The program that starts the stub counts the starts.
    """

    STEP = "step"
    RESET = "reset"
    CALL = "call"
    START = "start"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """The events at which a fault occurs: one event, every n-th event, a random share of events, or all.

    Attributes:
        event: the kind of event that the fault counts.
        at: the number of the only event at which the fault occurs; None if the other attributes decide.
        every: the fault can occur only at an event whose number is a multiple of `every`.
        probability: the probability of the fault at each such event.
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
        text: the description of the fault as the user wrote it.
        trigger: the events at which the fault occurs.
        service: a pattern for the paths of the affected services, relative to the robot; `*` matches any
            text, and "" means that no service is affected.
        topic: a pattern for the names of the affected topics, in the same form.
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
    """The process closes all connections and exits, although no client requested the end."""

    code: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hang(InjectedFault):
    """The process stops with its sockets open, or one service never responds again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Delayed(InjectedFault):
    """A fault with a delay: the latency, plus a random share of the jitter."""

    latency_s: float = 0.0
    jitter_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Slow(Delayed):
    """A step, a reset, or calls of a service take longer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Late(Delayed):
    """Messages of a step arrive late, after the response to the step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost(InjectedFault):
    """Messages of a step are dropped."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongValue(InjectedFault):
    """Each float in the reading of a message, or in a response, has the value `value`."""

    value: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class WrongShape(InjectedFault):
    """The second half of the bytes of a message or response is missing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryGrowth(InjectedFault):
    """The process allocates `mib` at each event and never frees it, up to a total of `most_mib`."""

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
    """The stub exits as if the ROS master did not respond; the stub's names stay registered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamesLost(InjectedFault):
    """The master has no names of the stub, as after a restart of the master; connections stay open."""
