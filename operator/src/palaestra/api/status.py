"""The status of a TrainingJob: what the operator tells people about it.

Numbers come from the trainers and are as old as the last poll. What is not known is absent, never
zero.

A status may have been written by another release. Unknown fields are ignored, and so are conditions
and simulators with an unknown word. An unknown phase, or a value of another type, is refused: it could
mean that a replica has ended. A field that is new since a5276f3 is absent unless it is set: the
programs of that release refuse a status with an unknown field.
"""

from datetime import datetime
from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import KNOWN_ONES, Count, Fraction, Image, Listed, Sentence, Word
from palaestra.api.history import Faults, Goodput, LastAttempt, MemoryKills
from palaestra.api.model import Reported
from palaestra.api.simulators import Role


class Phase(StrEnum):
    """Where a job or a replica stands, in one word."""

    PENDING = "Pending"
    RUNNING = "Running"
    SUSPENDED = "Suspended"
    SUCCEEDED = "Succeeded"
    FAILED = "Failed"


TERMINAL = frozenset({Phase.SUCCEEDED, Phase.FAILED})  # a job or a replica that came there stays there


class SimulatorPhase(StrEnum):
    """Where a simulator stands, as its sidecar tells it."""

    IDLE = "idle"
    STARTING = "starting"
    READY = "ready"
    STOPPING = "stopping"
    FAILED = "failed"


class ConditionType(StrEnum):
    """The conditions of a TrainingJob; the last two are present only while they hold."""

    ACCEPTED = "Accepted"
    RUNNING = "Running"
    SUSPENDED = "Suspended"
    SUCCEEDED = "Succeeded"
    FAILED = "Failed"
    RECONCILING = "Reconciling"
    STALLED = "Stalled"


class ConditionStatus(StrEnum):
    """Whether a condition holds."""

    TRUE = "True"
    FALSE = "False"
    UNKNOWN = "Unknown"


class Condition(Reported):
    """One claim about the job, with its reason, as Kubernetes' own conditions."""

    type: ConditionType = Field(strict=False)
    """`Accepted`, `Running`, `Suspended`, `Succeeded` or `Failed`; `Reconciling` or `Stalled`."""

    status: ConditionStatus = Field(strict=False)
    """`True`, `False` or `Unknown`."""

    reason: Word
    """Why, in one word for programs."""

    message: Sentence
    """Why, in a sentence for people: the fact and the remedy."""

    last_transition_time: datetime = Field(strict=False)
    """When `status` last changed."""

    observed_generation: Count | None = None
    """Generation of the spec that this speaks of; absent: unknown."""


class LastCheckpoint(Reported):
    """The newest checkpoint in the run directory."""

    step: Count
    """Environment steps learned from when it was written."""

    time: datetime = Field(strict=False)
    """When it was written."""


class Restarts(Reported):
    """What was started again in a replica, by cause.

    The attempt's number is 1 + trainer + disruption + suspension + operator.
    """

    trainer: Count = 0
    """Pods that were replaced because the trainer failed; these count against `backoffLimit`."""

    simulator: Count = 0
    """Simulators that were started again after a fault, over all attempts."""

    disruption: Count = 0
    """Pods that were replaced because the cluster took them (preemption, eviction, drain) or
    somebody deleted them; they do not count against `backoffLimit`."""

    suspension: Count = 0
    """Pods that were replaced because the job was suspended and resumed."""

    operator: Count | None = None
    """Pods that the operator replaced because no kubelet heals them: `TrainerNotStarted`,
    `RestartPolicyDropped`, `Stalled`. At most `backoffLimit` are; absent: none was."""


class PodReference(Reported):
    """The pod of the current attempt."""

    name: Word
    """Its name, for `kubectl logs`."""

    uid: Word
    """Its UID."""

    created: datetime = Field(strict=False)
    """When it was made."""


class SimulatorStatus(Reported):
    """One simulator of a replica, as the trainer tells it."""

    name: Word
    """Group and number: `collect-0`."""

    role: Role = Field(strict=False)
    """`Collect` or `Evaluate`."""

    state: SimulatorPhase = Field(strict=False)
    """`idle`, `starting`, `ready`, `stopping` or `failed`."""

    restarts: Count = 0
    """Restarts after a fault in this attempt; recycling is not counted."""

    last_fault: Sentence | None = None
    """The last fault in a sentence; absent: none in this attempt."""

    flapping: bool = False
    """True: it breaks again and again."""

    given_up: bool = False
    """True: its restarts are used up and the run goes on without it."""

    standby: Word | None = None
    """`starting` or `ready`: its spare; absent: it has none."""


class SuccessInterval(Reported):
    """The 95 % interval (Wilson) around a success rate."""

    low: Fraction
    """Its lower bound, 0 to 1."""

    high: Fraction
    """Its upper bound, 0 to 1."""

    episodes: Count
    """Episodes that were played."""


class ReplicaStatus(Reported):
    """One training run."""

    index: Count
    """Number of the replica, from 0."""

    phase: Phase = Field(default=Phase.PENDING, strict=False)
    """Where it stands; `Succeeded` and `Failed` are final."""

    reason: Word | None = None
    """Why, in one word for programs; absent: nothing to say."""

    message: Sentence | None = None
    """Why, in a sentence for people; absent: nothing to say."""

    since: datetime | None = Field(default=None, strict=False)
    """When `phase` or `reason` last changed; absent: not seen yet."""

    attempt: Count = 0
    """Number of the current pod, from 1; 0: none yet."""

    pod: PodReference | None = None
    """The pod of the current attempt; absent: none yet."""

    step: Count | None = None
    """Environment steps learned from; absent: not known yet."""

    target: Count | None = None
    """Environment steps at which it ends; absent: not known yet."""

    success_rate: Fraction | None = None
    """Share of successful episodes in the last evaluation or confirmation, 0 to 1; absent: none yet, or
    the environment reports no success."""

    success_interval: SuccessInterval | None = None
    """Where the true success rate lies; absent: as `successRate`, or an older trainer."""

    mean_return: float | None = None
    """Mean return of recent training episodes, in rewards; absent: none ended yet."""

    steps_per_second: Annotated[float, Field(ge=0)] | None = None
    """Environment steps a second, lately; absent: not known, or not running."""

    simulators: Annotated[Listed[SimulatorStatus], Field(max_length=32), KNOWN_ONES] = ()
    """Its simulators; empty: not known yet."""

    last_checkpoint: LastCheckpoint | None = None
    """The newest checkpoint; absent: none yet."""

    last_progress: datetime | None = Field(default=None, strict=False)
    """When `step` last moved, or an evaluation did, by the operator's clock; for people, nothing is counted
    from it. Absent: the current attempt has not begun to train."""

    furthest_step: Count | None = None
    """The highest step of all attempts; a new attempt goes on from the last checkpoint, which may
    be behind it. Absent: not known yet."""

    fruitless: Count = 0
    """Pods in a row whose trainer ran and that were taken or interrupted without a step beyond
    `furthestStep`; `noProgressLimit` bounds them. None is counted before a step was reported."""

    simulator_restarts: Count = 0
    """Simulators that were started again after a fault in the current attempt."""

    restarts: Restarts = Restarts()
    """What was started again, by cause."""

    last_attempt: LastAttempt | None = None
    """How the newest attempt that has ended did so; absent: none has."""

    memory_kills: Annotated[Listed[MemoryKills], Field(max_length=64)] = ()
    """Containers that were killed for their memory; empty: none."""

    faults: Faults | None = None
    """Faults of its simulators by kind, over all attempts; absent: not known yet."""

    goodput: Goodput | None = None
    """What the time was spent on, in seconds; absent: not known yet."""

    steps_lost: Count | None = None
    """Environment steps of episodes that a fault cut, and of those played again after an
    interruption, over all attempts; absent: not known yet."""


class Release(Reported):
    """The images that were fixed when the job was accepted, for whatever names none of its own."""

    trainer: Image
    """Image of trainer and ROS master."""

    stub: Image
    """Image of the stub simulator."""

    webots: Image
    """Image of Webots, which is not built here yet."""


class Status(Reported):
    """What the operator tells about a TrainingJob; never written by its author."""

    observed_generation: Count | None = None
    """Generation of the spec that this status speaks of; 0 or absent: no operator has seen the job yet."""

    phase: Phase | None = Field(default=None, strict=False)
    """The job in one word; absent: not seen yet."""

    release: Release | None = None
    """The images of the release that accepted the job, kept for its whole life; absent: not
    accepted yet."""

    conditions: Annotated[
        Listed[Condition],
        Field(
            max_length=16,
            json_schema_extra={
                "x-kubernetes-list-type": "map",
                "x-kubernetes-list-map-keys": ["type"],
            },
        ),
        KNOWN_ONES,
    ] = ()
    """`Accepted`, `Running`, `Suspended`, `Succeeded` and `Failed`, each with its reason; `Reconciling` while
    the job is on its way to what its spec asks for, `Stalled` when it cannot get there by itself."""

    start_time: datetime | None = Field(default=None, strict=False)
    """When the first pod started, by its node's clock; absent: none has."""

    completion_time: datetime | None = Field(default=None, strict=False)
    """When the operator found that the last replica had ended, by its own clock;
    `ttlSecondsAfterFinished` counts from here. Absent: not all have ended."""

    active_seconds: Count = 0
    """Seconds that the job was active before `activeSince`; suspended time is not counted. They are written
    with whatever else changes."""

    active_since: datetime | None = Field(default=None, strict=False)
    """When `activeSeconds` was counted, by the operator's clock; absent: the job is suspended, has ended, or
    was not seen yet."""

    running: Word | None = None
    """Replicas that run or have succeeded, of all: `2/2`; absent: not seen yet."""

    step: Count | None = None
    """Step of the replica that is furthest behind; absent: not known yet."""

    success_rate: Fraction | None = None
    """Success rate of the worst replica, 0 to 1; absent: nothing evaluated yet."""

    replicas: Annotated[
        Listed[ReplicaStatus],
        Field(
            max_length=100,
            json_schema_extra={
                "x-kubernetes-list-type": "map",
                "x-kubernetes-list-map-keys": ["index"],
            },
        ),
    ] = ()
    """One entry for each replica, by index; empty: not seen yet."""
