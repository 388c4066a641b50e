"""A trainer's reports: `/status` while it runs, and the termination message at its end.

The operator reads both from a pod that it does not trust, so readers are strict and bounded. Writers keep the
same bounds, so that a long error message of a trainer never hides its status.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Self

from palaestra_protocol.control import MOST_LEFT_OUT, SidecarState
from palaestra_protocol.fields import MOST_COUNT, MOST_NAME, ProtocolError, decoded
from palaestra_protocol.messages import (
    ChoiceText,
    Flag,
    JsonMessage,
    Lines,
    Maybe,
    NewestLines,
    NewestPartList,
    Number,
    Part,
    PartList,
    Table,
    Text,
    Time,
    Whole,
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

MOST_SIMULATORS = 32
MOST_FAULTS = 10  # the newest ones, in a termination message
MOST_LINES = 10  # the last lines of the trainer's log, in a termination message
MOST_LINE = 200  # characters of such a log line, and of the fact of such a fault
MOST_REASON = 2000
MOST_TERMINATION_BYTES = 4096  # Source: Kubernetes cuts a container's termination message there

_LONGEST_ESCAPE = 12  # bytes of one character in JSON: two \uXXXX


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckpointStatus(JsonMessage):
    """The newest checkpoint: its environment step, and when it was written (RFC 3339)."""

    step: Annotated[int, Whole()]
    time: Annotated[str, Time()]


@dataclass(frozen=True, slots=True, kw_only=True)
class SuccessInterval(JsonMessage):
    """The 95 % confidence interval of a policy's success rate, from the episodes that were played.

    Attributes:
        low: its lower bound, 0 to 1.
        high: its upper bound, 0 to 1.
        episodes: how many were played.
    """

    low: Annotated[float, Number(0.0, 1.0)]
    high: Annotated[float, Number(0.0, 1.0)]
    episodes: Annotated[int, Whole(1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorStatus(JsonMessage):
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

    name: Annotated[str, Text(MOST_NAME, least=1)]
    role: Annotated[str, ChoiceText(Role)]
    state: Annotated[str, ChoiceText(SidecarState)]
    restarts: Annotated[int, Whole()] = 0
    last_fault: Annotated[str | None, Maybe(Text())] = None
    flapping: Annotated[bool, Maybe(Flag())] = False
    given_up: Annotated[bool, Maybe(Flag())] = False
    standby: Annotated[str | None, Maybe(ChoiceText(StandbyState))] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainerStatus(JsonMessage):
    """The progress and state of a run.

    Attributes:
        step: valid environment steps learned from, over all attempts.
        target: steps at which the run ends.
        episodes: training episodes that ended.
        mean_return: the mean return of recent training episodes; None if none has ended yet.
        success_rate: the success rate of the last evaluation or confirmation, 0 to 1; None before the first
            one, or if the environment does not report success.
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

    step: Annotated[int, Whole()]
    target: Annotated[int, Whole()]
    episodes: Annotated[int, Whole()]
    phase: Annotated[str, Text(MOST_NAME, least=1)]
    mean_return: Annotated[float | None, Maybe(Number())] = None
    success_rate: Annotated[float | None, Maybe(Number(0.0, 1.0))] = None
    success_interval: Annotated[SuccessInterval | None, Maybe(Part(SuccessInterval))] = None
    steps_per_second: Annotated[float | None, Maybe(Number(0.0))] = None
    simulators: Annotated[tuple[SimulatorStatus, ...], PartList(SimulatorStatus, MOST_SIMULATORS)] = ()
    last_checkpoint: Annotated[CheckpointStatus | None, Maybe(Part(CheckpointStatus))] = None
    last_progress: Annotated[str | None, Maybe(Time())] = None
    last_progress_age_s: Annotated[float | None, Maybe(Number(0.0, MOST_COUNT))] = None
    attempt: Annotated[int | None, Maybe(Whole(1))] = None
    faults: Annotated[Mapping[str, int], Maybe(Table(FaultKind, Whole()))] = field(default_factory=dict)
    goodput: Annotated[Mapping[str, float], Maybe(Table(Cause, Number(0.0, MOST_COUNT)))] = field(
        default_factory=dict
    )
    steps_lost: Annotated[int, Maybe(Whole())] = 0
    left_out: Annotated[tuple[str, ...], Maybe(Lines(MOST_NAME, MOST_LEFT_OUT))] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRecord(JsonMessage):
    """One fault of one simulator, in a termination message.

    Attributes:
        time: when the trainer detected it (RFC 3339).
        simulator: group and number, such as collect-0.
        kind: one of `FaultKind`.
        fact: what happened, in a sentence.
        step: number of valid environment steps that the run had then.
    """

    time: Annotated[str, Time()]
    simulator: Annotated[str, Text(MOST_NAME, least=1)]
    kind: Annotated[str, ChoiceText(FaultKind)]
    fact: Annotated[str, Text(MOST_LINE)]
    step: Annotated[int, Whole()]


@dataclass(frozen=True, slots=True, kw_only=True)
class Termination(JsonMessage):
    """A trainer's termination message, which reaches the operator even if no poll came in time.

    Attributes:
        step: valid environment steps learned from.
        reason: the reason for its end, in a sentence.
        success_rate: the success rate of the last evaluation or confirmation, 0 to 1; None without an
            evaluation, or if the environment does not report success.
        success_interval: around `success_rate`; None in the same cases.
        last_checkpoint: the newest; None if there is no checkpoint.
        attempt: number of this attempt in the run directory's record, from 1; None if not recorded.
        restarts: the restarts of simulators after faults, in this attempt; None if not reported.
        log: the last lines of the trainer's log, the newest last; at most ten.
        faults: the last ones of this attempt, the newest last; at most ten.
    """

    step: Annotated[int, Whole()]
    reason: Annotated[str, Text(MOST_REASON)]
    success_rate: Annotated[float | None, Maybe(Number(0.0, 1.0))] = None
    success_interval: Annotated[SuccessInterval | None, Maybe(Part(SuccessInterval))] = None
    last_checkpoint: Annotated[CheckpointStatus | None, Maybe(Part(CheckpointStatus))] = None
    attempt: Annotated[int | None, Maybe(Whole(1))] = None
    restarts: Annotated[int | None, Maybe(Whole())] = None
    log: Annotated[tuple[str, ...], Maybe(NewestLines(MOST_LINE, MOST_LINES))] = ()
    faults: Annotated[tuple[FaultRecord, ...], Maybe(NewestPartList(FaultRecord, MOST_FAULTS))] = ()

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

    @classmethod
    def from_message(cls, message: str) -> Self:
        """Return the object that `to_message` wrote.

        Raises:
            ProtocolError: it is anything else, such as the end of a log, or too long.
        """
        return cls.from_json(decoded(message.encode("utf-8", "replace"), MOST_TERMINATION_BYTES))


def _length(content: object) -> int:
    """Return the length of `content` in bytes as JSON in ASCII."""
    return len(json.dumps(content))
