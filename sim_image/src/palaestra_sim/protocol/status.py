"""What a trainer tells of its run: `/status` while it runs, its last word, and its exit code.

The operator reads all three out of a pod that it does not trust, so reading is strict and bounded;
writing stays within the bounds, so that a trainer's long error message never hides its status.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from typing import Any, Self

from palaestra_sim.protocol.control import SidecarState
from palaestra_sim.protocol.fields import MOST_NAME, Fields, ProtocolError, clipped, decoded, known

__all__ = [
    "CheckpointStatus",
    "ExitCode",
    "ProtocolError",
    "SimulatorRole",
    "SimulatorStatus",
    "Termination",
    "TrainerStatus",
    "decoded",
]

MOST_SIMULATORS = 32
MOST_REASON = 2000
MOST_TERMINATION_BYTES = 4096  # Source: Kubernetes cuts a container's termination message there

_LONGEST_ESCAPE = 12  # bytes of one character in JSON: two \uXXXX


class ExitCode(IntEnum):
    """How a trainer ends; anything else is unexpected and may be tried again.

    DONE: the run has ended. CONFIGURATION: it is wrong, don't retry. INTERRUPTED: by a signal, and
    a checkpoint was written. FAULT_BUDGET: a simulator failed too often, don't retry. DIVERGED: the
    learner did, don't retry. STALLED: no environment step for too long, retry.
    """

    DONE = 0
    CONFIGURATION = 2
    INTERRUPTED = 75
    FAULT_BUDGET = 80
    DIVERGED = 81
    STALLED = 82


class SimulatorRole(StrEnum):
    """What a simulator's episodes are for: to learn from, or to measure the policy."""

    COLLECT = "Collect"
    EVALUATE = "Evaluate"


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
        """Return what `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(step=fields.whole("step"), time=fields.time("time"))


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorStatus:
    """One simulator, as its trainer sees it.

    Attributes:
        name: group and number, as collect-0.
        role: Collect or Evaluate.
        state: one of the states of a sidecar.
        restarts: after faults, in this attempt; recycling is not counted.
        last_fault: in a sentence; None: no fault in this attempt.
    """

    name: str
    role: str
    state: str
    restarts: int = 0
    last_fault: str | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data, texts cut to what a reader takes."""
        return {
            "name": clipped(self.name, MOST_NAME),
            "role": self.role,
            "state": self.state,
            "restarts": self.restarts,
            "last_fault": None if self.last_fault is None else clipped(self.last_fault),
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return what `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            name=fields.text("name", MOST_NAME, least=1),
            role=fields.choice("role", SimulatorRole).value,
            state=fields.choice("state", SidecarState).value,
            restarts=fields.whole("restarts"),
            last_fault=fields.text("last_fault") if fields.has("last_fault") else None,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainerStatus:
    """Where a run stands.

    Attributes:
        step: valid environment steps learned from, over all attempts.
        target: steps at which the run ends.
        episodes: training episodes that ended.
        mean_return: of recent training episodes; None: none ended yet.
        success_rate: of the last evaluation, 0 to 1; None: none yet.
        steps_per_second: lately; None: not known.
        simulators: each of them.
        last_checkpoint: the newest; None: none yet.
        last_progress: when an environment last stepped (RFC 3339); None: never yet.
        phase: what the trainer does now, in one word.
        attempt: number of this attempt by the run directory's record, from 1; None: not recorded yet.
    """

    step: int
    target: int
    episodes: int
    phase: str
    mean_return: float | None = None
    success_rate: float | None = None
    steps_per_second: float | None = None
    simulators: tuple[SimulatorStatus, ...] = ()
    last_checkpoint: CheckpointStatus | None = None
    last_progress: str | None = None
    attempt: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data; a number that is not finite is not known."""
        checkpoint = self.last_checkpoint
        return {
            "step": self.step,
            "target": self.target,
            "episodes": self.episodes,
            "phase": clipped(self.phase, MOST_NAME),
            "mean_return": known(self.mean_return),
            "success_rate": known(self.success_rate),
            "steps_per_second": known(self.steps_per_second),
            "simulators": [each.to_json() for each in self.simulators[:MOST_SIMULATORS]],
            "last_checkpoint": None if checkpoint is None else checkpoint.to_json(),
            "last_progress": self.last_progress,
            "attempt": self.attempt,
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return what `to_json` wrote.

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
            steps_per_second=_speed(fields),
            simulators=fields.parts("simulators", SimulatorStatus.from_json, MOST_SIMULATORS),
            last_checkpoint=_checkpoint(fields),
            last_progress=fields.time("last_progress") if fields.has("last_progress") else None,
            attempt=_attempt(fields),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Termination:
    """A trainer's last word: the truth of a run that does not hang on having been asked in time.

    Attributes:
        step: valid environment steps learned from.
        reason: why it ended, in a sentence.
        success_rate: of the last evaluation, 0 to 1; None: none.
        last_checkpoint: the newest; None: none.
        attempt: number of this attempt by the run directory's record, from 1; None: not recorded.
        restarts: of simulators after faults, in this attempt; None: not told.
    """

    step: int
    reason: str
    success_rate: float | None = None
    last_checkpoint: CheckpointStatus | None = None
    attempt: int | None = None
    restarts: int | None = None

    def to_message(self) -> str:
        """Return the termination message: JSON of at most 4096 bytes, the reason cut to fit."""
        word = self
        while (excess := len(message := json.dumps(word.to_json())) - MOST_TERMINATION_BYTES) > 0:
            shorter = word.to_json()["reason"][: -(excess // _LONGEST_ESCAPE + 1)]
            word = replace(word, reason=shorter)
        return message

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON data, the reason cut to what a reader takes."""
        checkpoint = self.last_checkpoint
        return {
            "step": self.step,
            "reason": clipped(self.reason, MOST_REASON),
            "success_rate": known(self.success_rate),
            "last_checkpoint": None if checkpoint is None else checkpoint.to_json(),
            "attempt": self.attempt,
            "restarts": self.restarts,
        }

    @classmethod
    def from_message(cls, message: str) -> Self:
        """Return what `to_message` wrote.

        Raises:
            ProtocolError: it is anything else, such as the end of a log, or longer.
        """
        return cls.from_json(decoded(message.encode("utf-8", "replace"), MOST_TERMINATION_BYTES))

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return what `to_json` wrote.

        Raises:
            ProtocolError: `content` is anything else.
        """
        fields = Fields(content, path)
        return cls(
            step=fields.whole("step"),
            reason=fields.text("reason", MOST_REASON),
            success_rate=_share(fields),
            last_checkpoint=_checkpoint(fields),
            attempt=_attempt(fields),
            restarts=fields.whole("restarts") if fields.has("restarts") else None,
        )


def _attempt(fields: Fields) -> int | None:
    return fields.whole("attempt", 1) if fields.has("attempt") else None


def _share(fields: Fields) -> float | None:
    return fields.number("success_rate", 0.0, 1.0) if fields.has("success_rate") else None


def _speed(fields: Fields) -> float | None:
    return fields.number("steps_per_second", 0.0) if fields.has("steps_per_second") else None


def _checkpoint(fields: Fields) -> CheckpointStatus | None:
    if not fields.has("last_checkpoint"):
        return None
    return fields.part("last_checkpoint", CheckpointStatus.from_json)
