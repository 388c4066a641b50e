"""A trainer's reports: `/status` while it runs, and the termination message after it has ended.

The operator does not trust the pod that sends these reports, so readers check the type and the bounds of each
value. Writers keep the same bounds. So a long error message of a trainer does not make its status unreadable.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Self

from palaestra_protocol.control import MOST_LEFT_OUT, SidecarState
from palaestra_protocol.fields import MOST_COUNT, MOST_NAME, ProtocolError, decoded
from palaestra_protocol.messages import (
    AddedLater,
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
    "EvaluationStatus",
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
MOST_FAULTS = 10  # maximum number of faults in a termination message; older faults are dropped
MOST_LINES = 10  # maximum number of log lines in a termination message; older lines are dropped
MOST_LINE = 200  # maximum number of characters of a log line, and of `FaultRecord.fact`
MOST_REASON = 2000
MOST_TERMINATION_BYTES = 4096  # Kubernetes cuts a container's termination message at this length

_LONGEST_ESCAPE = 12  # maximum number of bytes of one character in JSON: two escapes \uXXXX


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckpointStatus(JsonMessage):
    """The newest checkpoint: its environment step, and the time at which it was written (RFC 3339)."""

    step: Annotated[int, Whole()]
    time: Annotated[str, Time()]


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluationStatus(JsonMessage):
    """One evaluation of a policy during training; a confirmation is not an evaluation.

    Attributes:
        step: number of valid environment steps from which the policy had learned.
        success_rate: share of successful episodes, 0 to 1; None: the environment does not report success.
        mean_return: mean return of the evaluation's episodes; None: the program does not report returns.
    """

    step: Annotated[int, Whole()]
    success_rate: Annotated[float | None, Maybe(Number(0.0, 1.0))] = None
    mean_return: Annotated[float | None, Maybe(Number())] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SuccessInterval(JsonMessage):
    """The 95 % confidence interval of a policy's success rate in an evaluation.

    Attributes:
        low: the lower bound, 0 to 1.
        high: the upper bound, 0 to 1.
        episodes: the number of episodes in the evaluation.
    """

    low: Annotated[float, Number(0.0, 1.0)]
    high: Annotated[float, Number(0.0, 1.0)]
    episodes: Annotated[int, Whole(1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorStatus(JsonMessage):
    """The status of one simulator, as its trainer reports it.

    Attributes:
        name: the simulator's group and number, such as collect-0.
        role: Collect or Evaluate.
        state: a `SidecarState`.
        restarts: number of restarts after faults in this attempt; planned recycling is not counted.
        last_fault: the last fault in this attempt, in a sentence; None if there was no fault.
        flapping: whether the simulator fails repeatedly.
        given_up: whether the simulator's restart budget is spent, so that the run continues without this
            simulator.
        standby: the state of the simulator's standby, starting or ready; None if it has no standby.
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
        step: number of valid environment steps that the algorithm learned from, over all attempts.
        target: number of steps after which the run ends.
        episodes: number of training episodes that ended.
        phase: the current activity of the trainer, in one word.
        mean_return: the mean return of recent training episodes; None before the first episode has ended.
        success_rate: the success rate of the last evaluation or confirmation, 0 to 1; None before the first
            evaluation, or if the environment does not report success.
        success_interval: the confidence interval of `success_rate`; None if `success_rate` is None.
        steps_per_second: the recent speed; None if unknown.
        simulators: the status of each simulator.
        last_checkpoint: the newest checkpoint; None if there is no checkpoint yet.
        last_progress: time of the last environment step (RFC 3339); None before the first step.
        last_progress_age_s: seconds since the last environment step; None before the first step. The trainer
            measures them with a monotonic clock, so a change of the wall clock has no effect.
        attempt: number of this attempt, counted from 1 in the run directory's record; None if it is not yet
            recorded.
        faults: number of faults of each `FaultKind`, over all attempts.
        goodput: seconds spent on each `Cause`, over all attempts.
        steps_lost: valid steps that were lost, over all attempts: steps after the checkpoint from which an
            attempt resumed, and steps in a training or evaluation episode that a fault cut short.
        left_out: the nodes that the simulators leave out of their worlds, as text for people; each line
            begins with the name of the simulators' group.
        last_evaluation: the newest evaluation; None before the first evaluation, or if the trainer's release
            does not report evaluations.
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
    last_evaluation: Annotated[EvaluationStatus | None, AddedLater(Part(EvaluationStatus))] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRecord(JsonMessage):
    """One fault of one simulator, in a termination message.

    Attributes:
        time: the time at which the trainer detected the fault (RFC 3339).
        simulator: the simulator's group and number, such as collect-0.
        kind: one of `FaultKind`.
        fact: a description of the fault, in a sentence.
        step: number of valid environment steps of the run at that time.
    """

    time: Annotated[str, Time()]
    simulator: Annotated[str, Text(MOST_NAME, least=1)]
    kind: Annotated[str, ChoiceText(FaultKind)]
    fact: Annotated[str, Text(MOST_LINE)]
    step: Annotated[int, Whole()]


@dataclass(frozen=True, slots=True, kw_only=True)
class Termination(JsonMessage):
    """A trainer's termination message.

    Kubernetes keeps it in the pod's status, so the operator can read it after the trainer has ended.

    Attributes:
        step: number of valid environment steps that the algorithm learned from.
        reason: the reason for which the trainer ended, in a sentence.
        success_rate: the success rate of the last evaluation or confirmation, 0 to 1; if the run is complete,
            of the best policy; None without an evaluation, or if the environment does not report success.
        success_interval: the confidence interval of `success_rate`; None if `success_rate` is None.
        last_checkpoint: the newest checkpoint; None if there is no checkpoint.
        attempt: number of this attempt, counted from 1 in the run directory's record; None if not recorded.
        restarts: number of restarts of simulators after faults in this attempt; None if it is unknown.
        log: the last lines of the trainer's log, at most ten, the newest last.
        faults: the last faults of this attempt, at most ten, the newest last.
        last_evaluation: the newest evaluation; None without an evaluation, or if the trainer's release does
            not report evaluations.
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
    last_evaluation: Annotated[EvaluationStatus | None, AddedLater(Part(EvaluationStatus))] = None

    def to_message(self) -> str:
        """Return the termination message: JSON of at most 4096 bytes.

        If the message is too long, the oldest log lines and faults are dropped. If the message is still too
        long without log lines and faults, the reason is cut.
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
            ProtocolError: `message` is too long, or is not a termination message but, say, the end of a log.
        """
        return cls.from_json(decoded(message.encode("utf-8", "replace"), MOST_TERMINATION_BYTES))


def _length(content: object) -> int:
    """Return the number of bytes of `content` as JSON in ASCII."""
    return len(json.dumps(content))
