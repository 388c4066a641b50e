"""A trainer's reports: `/status` while it runs, and the termination message at its end.

The operator reads both from a pod that it does not trust, so readers are strict and bounded. Writers keep the
same bounds, so that a long error message of a trainer never hides its status.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Self, TypeVar

from palaestra_protocol.control import MOST_LEFT_OUT, SidecarState, left_out
from palaestra_protocol.fields import (
    MOST_COUNT,
    MOST_NAME,
    Fields,
    ProtocolError,
    clipped,
    decoded,
    enumerated,
    known,
)
from palaestra_protocol.pod.enums import Cause, ExitCode, FaultKind, Role, StandbyState

__all__ = [
    "Cause",
    "CheckpointStatus",
    "ExitCode",
    "FaultKind",
    "FaultRecord",
    "ProtocolError",
    "Role",
    "SimulatorStatus",
    "StandbyState",
    "SuccessInterval",
    "Termination",
    "TrainerStatus",
    "decoded",
]

T = TypeVar("T")

MOST_SIMULATORS = 32
MOST_FAULTS = 10  # the newest ones, in a termination message
MOST_LINES = 10  # the last lines of the trainer's log, in a termination message
MOST_LINE = 200  # characters of such a log line, and of the fact of such a fault
MOST_REASON = 2000
MOST_TERMINATION_BYTES = 4096  # Source: Kubernetes cuts a container's termination message there

_LONGEST_ESCAPE = 12  # bytes of one character in JSON: two \uXXXX


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckpointStatus:
    """The newest checkpoint: its environment step, and when it was written (RFC 3339)."""

    step: int
    time: str

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {"step": self.step, "time": self.time}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(step=fields.whole("step"), time=fields.time("time"))


@dataclass(frozen=True, slots=True, kw_only=True)
class SuccessInterval:
    """The 95 % confidence interval of a policy's success rate, from the episodes that were played.

    Attributes:
        low: its lower bound, 0 to 1.
        high: its upper bound, 0 to 1.
        episodes: how many were played.
    """

    low: float
    high: float
    episodes: int

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return {"low": self.low, "high": self.high, "episodes": self.episodes}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            low=fields.number("low", 0.0, 1.0),
            high=fields.number("high", 0.0, 1.0),
            episodes=fields.whole("episodes", 1),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorStatus:
    """One simulator, from its trainer's view.

    Attributes:
        name: group and number, such as collect-0.
        role: Collect or Evaluate.
        state: one of the states of a sidecar.
        restarts: after faults, in this attempt; planned recycling is not counted.
        last_fault: in a sentence; None if it had no fault in this attempt.
        flapping: whether it fails repeatedly.
        given_up: whether its restart budget is spent, so that the run continues without it.
        standby: the state of its standby, starting or ready; None if it has no standby.
    """

    name: str
    role: str
    state: str
    restarts: int = 0
    last_fault: str | None = None
    flapping: bool = False
    given_up: bool = False
    standby: str | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data, with texts cut to the lengths that a reader accepts."""
        return {
            "name": clipped(self.name, MOST_NAME),
            "role": self.role,
            "state": self.state,
            "restarts": self.restarts,
            "last_fault": None if self.last_fault is None else clipped(self.last_fault),
            "flapping": self.flapping,
            "given_up": self.given_up,
            "standby": self.standby,
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            name=fields.text("name", MOST_NAME, least=1),
            role=fields.choice("role", Role).value,
            state=fields.choice("state", SidecarState).value,
            restarts=fields.whole("restarts"),
            last_fault=fields.text("last_fault") if fields.has("last_fault") else None,
            flapping=fields.has("flapping") and fields.flag("flapping"),
            given_up=fields.has("given_up") and fields.flag("given_up"),
            standby=fields.choice("standby", StandbyState).value if fields.has("standby") else None,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainerStatus:
    """The progress and state of a run.

    Attributes:
        step: valid environment steps learned from, over all attempts.
        target: steps at which the run ends.
        episodes: training episodes that ended.
        mean_return: of recent training episodes; None if none has ended yet.
        success_rate: of the last evaluation or confirmation, 0 to 1; None before the first one, or if the
            environment does not report success.
        success_interval: around `success_rate`; None in the same cases.
        steps_per_second: recently; None if unknown.
        simulators: one status for each.
        last_checkpoint: the newest; None if there is no checkpoint yet.
        last_progress: time of the last environment step (RFC 3339); None before the first one.
        last_progress_age_s: seconds since then by the trainer's monotonic clock, which does not depend on
            the wall clock; None before the first step.
        phase: the current activity of the trainer, in one word.
        attempt: number of this attempt in the run directory's record, from 1; None if not recorded yet.
        faults: how many of each `FaultKind`, over all attempts.
        goodput: seconds spent on each `Cause`, over all attempts.
        steps_lost: valid steps that were lost, over all attempts: steps after the checkpoint from which an
            attempt resumed, and steps in a training or evaluation episode that a fault cut short.
        left_out: the nodes that the simulators leave out of their worlds, in lines that begin with the group.
    """

    step: int
    target: int
    episodes: int
    phase: str
    mean_return: float | None = None
    success_rate: float | None = None
    success_interval: SuccessInterval | None = None
    steps_per_second: float | None = None
    simulators: tuple[SimulatorStatus, ...] = ()
    last_checkpoint: CheckpointStatus | None = None
    last_progress: str | None = None
    last_progress_age_s: float | None = None
    attempt: int | None = None
    faults: Mapping[str, int] = field(default_factory=dict)
    goodput: Mapping[str, float] = field(default_factory=dict)
    steps_lost: int = 0
    left_out: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data; a number that is not finite becomes null, which means unknown."""
        checkpoint, interval = self.last_checkpoint, self.success_interval
        return {
            "step": self.step,
            "target": self.target,
            "episodes": self.episodes,
            "phase": clipped(self.phase, MOST_NAME),
            "mean_return": known(self.mean_return),
            "success_rate": known(self.success_rate),
            "success_interval": None if interval is None else interval.to_json(),
            "steps_per_second": known(self.steps_per_second),
            "simulators": [simulator.to_json() for simulator in self.simulators[:MOST_SIMULATORS]],
            "last_checkpoint": None if checkpoint is None else checkpoint.to_json(),
            "last_progress": self.last_progress,
            "last_progress_age_s": known(self.last_progress_age_s),
            "attempt": self.attempt,
            "faults": dict(self.faults),
            "goodput": {cause: known(seconds) for cause, seconds in self.goodput.items()},
            "steps_lost": self.steps_lost,
            "left_out": enumerated(self.left_out, MOST_NAME, MOST_LEFT_OUT),
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            step=fields.whole("step"),
            target=fields.whole("target"),
            episodes=fields.whole("episodes"),
            phase=fields.text("phase", MOST_NAME, least=1),
            mean_return=fields.number("mean_return") if fields.has("mean_return") else None,
            success_rate=_share(fields),
            success_interval=_interval(fields),
            steps_per_second=_speed(fields),
            simulators=fields.parts("simulators", SimulatorStatus.from_json, MOST_SIMULATORS),
            last_checkpoint=_checkpoint(fields),
            last_progress=fields.time("last_progress") if fields.has("last_progress") else None,
            last_progress_age_s=_age(fields),
            attempt=_attempt(fields),
            faults=_table(fields, "faults", FaultKind, Fields.whole),
            goodput=_table(fields, "goodput", Cause, _seconds),
            steps_lost=fields.whole("steps_lost") if fields.has("steps_lost") else 0,
            left_out=left_out(fields, MOST_NAME),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRecord:
    """One fault of one simulator, in a termination message.

    Attributes:
        time: when the trainer detected it (RFC 3339).
        simulator: group and number, such as collect-0.
        kind: one of `FaultKind`.
        fact: what happened, in a sentence.
        step: number of valid environment steps that the run had then.
    """

    time: str
    simulator: str
    kind: str
    fact: str
    step: int

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data, with texts cut to the lengths that a reader accepts."""
        return {
            "time": self.time,
            "simulator": clipped(self.simulator, MOST_NAME),
            "kind": self.kind,
            "fact": clipped(self.fact, MOST_LINE),
            "step": self.step,
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            time=fields.time("time"),
            simulator=fields.text("simulator", MOST_NAME, least=1),
            kind=fields.choice("kind", FaultKind).value,
            fact=fields.text("fact", MOST_LINE),
            step=fields.whole("step"),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Termination:
    """A trainer's termination message, which reaches the operator even if no poll came in time.

    Attributes:
        step: valid environment steps learned from.
        reason: the reason for its end, in a sentence.
        success_rate: of the last evaluation or confirmation, 0 to 1; None if there was none, or if the
            environment does not report success.
        success_interval: around `success_rate`; None in the same cases.
        last_checkpoint: the newest; None if there is no checkpoint.
        attempt: number of this attempt in the run directory's record, from 1; None if not recorded.
        restarts: of simulators after faults, in this attempt; None if not reported.
        log: the last lines of the trainer's log, the newest last; at most ten.
        faults: the last ones of this attempt, the newest last; at most ten.
    """

    step: int
    reason: str
    success_rate: float | None = None
    success_interval: SuccessInterval | None = None
    last_checkpoint: CheckpointStatus | None = None
    attempt: int | None = None
    restarts: int | None = None
    log: tuple[str, ...] = ()
    faults: tuple[FaultRecord, ...] = ()

    def to_message(self) -> str:
        """Return the termination message: JSON of at most 4096 bytes.

        To fit, the oldest lines and faults are dropped; after the last of them, the reason is cut.
        """
        word = self
        while (excess := _length(word.to_json()) - MOST_TERMINATION_BYTES) > 0:
            word = word.shorter(excess)
        return json.dumps(word.to_json())

    def shorter(self, excess: int) -> Self:
        """Return a shorter copy: drop the oldest log line or fault, else cut the reason by `excess` bytes."""
        content = self.to_json()
        if self.log and _length(content["log"]) >= _length(content["faults"]):
            return replace(self, log=self.log[-MOST_LINES:][1:])
        if self.faults:
            return replace(self, faults=self.faults[-MOST_FAULTS:][1:])
        return replace(self, reason=content["reason"][: -(excess // _LONGEST_ESCAPE + 1)])

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data, with texts and lists cut to the lengths that a reader accepts."""
        checkpoint, interval = self.last_checkpoint, self.success_interval
        return {
            "step": self.step,
            "reason": clipped(self.reason, MOST_REASON),
            "success_rate": known(self.success_rate),
            "success_interval": None if interval is None else interval.to_json(),
            "last_checkpoint": None if checkpoint is None else checkpoint.to_json(),
            "attempt": self.attempt,
            "restarts": self.restarts,
            "log": [clipped(line, MOST_LINE) for line in self.log[-MOST_LINES:]],
            "faults": [fault.to_json() for fault in self.faults[-MOST_FAULTS:]],
        }

    @classmethod
    def from_message(cls, message: str) -> Self:
        """Return the object that `to_message` wrote.

        Raises:
            ProtocolError: it is anything else, such as the end of a log, or too long.
        """
        return cls.from_json(decoded(message.encode("utf-8", "replace"), MOST_TERMINATION_BYTES))

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            step=fields.whole("step"),
            reason=fields.text("reason", MOST_REASON),
            success_rate=_share(fields),
            success_interval=_interval(fields),
            last_checkpoint=_checkpoint(fields),
            attempt=_attempt(fields),
            restarts=fields.whole("restarts") if fields.has("restarts") else None,
            log=fields.texts("log", MOST_LINE, MOST_LINES) if fields.has("log") else (),
            faults=_fault_records(fields),
        )


def _length(content: object) -> int:
    """Return the length of `content` in bytes as JSON in ASCII."""
    return len(json.dumps(content))


def _table(
    fields: Fields, name: str, rows: Iterable[StrEnum], read: Callable[[Fields, str], T]
) -> dict[str, T]:
    """Return an object's values for those names in `rows` that it has; a newer release may add names."""
    if not fields.has(name):
        return {}
    table = fields.part(name, Fields)
    return {row.value: read(table, row.value) for row in rows if table.has(row.value)}


def _seconds(fields: Fields, name: str) -> float:
    return fields.number(name, 0.0, MOST_COUNT)


def _fault_records(fields: Fields) -> tuple[FaultRecord, ...]:
    return fields.parts("faults", FaultRecord.from_json, MOST_FAULTS) if fields.has("faults") else ()


def _attempt(fields: Fields) -> int | None:
    return fields.whole("attempt", 1) if fields.has("attempt") else None


def _share(fields: Fields) -> float | None:
    return fields.number("success_rate", 0.0, 1.0) if fields.has("success_rate") else None


def _interval(fields: Fields) -> SuccessInterval | None:
    name = "success_interval"
    return fields.part(name, SuccessInterval.from_json) if fields.has(name) else None


def _speed(fields: Fields) -> float | None:
    return fields.number("steps_per_second", 0.0) if fields.has("steps_per_second") else None


def _age(fields: Fields) -> float | None:
    name = "last_progress_age_s"
    return fields.number(name, 0.0, MOST_COUNT) if fields.has(name) else None


def _checkpoint(fields: Fields) -> CheckpointStatus | None:
    if not fields.has("last_checkpoint"):
        return None
    return fields.part("last_checkpoint", CheckpointStatus.from_json)
