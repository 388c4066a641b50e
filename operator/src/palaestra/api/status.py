"""The status of a TrainingJob, which the operator writes.

The numbers come from the trainers and are as old as the last poll. An unknown value is absent, never zero.

Another release may have written a status. The operator ignores unknown fields, and drops conditions and
simulators with an unknown enum value. It refuses a status with an unknown phase or a value of a wrong type,
because such a value could mean that a replica has ended. A field that a later release adds must be absent
unless it is set.
"""

from datetime import datetime
from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.attempt_status import Faults, Goodput, LastAttempt, LastEvaluation, MemoryKills
from palaestra.api.fields import KNOWN_ITEMS, Count, Fraction, Image, Listed, Sentence, Word, Words
from palaestra.api.model import StatusModel
from palaestra_protocol.control import SidecarState
from palaestra_protocol.pod.enums import Role


class Phase(StrEnum):
    """Phase of a job or a replica."""

    PENDING = "Pending"
    RUNNING = "Running"
    SUSPENDED = "Suspended"
    SUCCEEDED = "Succeeded"
    FAILED = "Failed"


TERMINAL = frozenset({Phase.SUCCEEDED, Phase.FAILED})  # These phases are final for a job or replica.


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


class Condition(StatusModel):
    """A condition of the job, in the format of Kubernetes' own conditions."""

    type: ConditionType = Field(strict=False)
    """`Accepted`, `Running`, `Suspended`, `Succeeded` or `Failed`; also `Reconciling` or `Stalled`, which
    exist only while they are true."""

    status: ConditionStatus = Field(strict=False)
    """`True`, `False` or `Unknown`."""

    reason: Word
    """Reason for the state of the condition, in one word for programs."""

    message: Sentence
    """Reason for the state of the condition, in a sentence for people: the fact and the remedy."""

    last_transition_time: datetime = Field(strict=False)
    """Time of the last change of `status`."""

    observed_generation: Count | None = None
    """Generation of the spec to which this condition applies; absent: unknown."""


class LastCheckpoint(StatusModel):
    """The newest checkpoint in the run directory."""

    step: Count
    """Environment steps trained when it was saved."""

    time: datetime = Field(strict=False)
    """Time at which it was saved."""


class Restarts(StatusModel):
    """Restarts in a replica, by cause.

    The number of the attempt is 1 + trainer + disruption + suspension + operator.
    """

    trainer: Count = 0
    """Pods replaced because the trainer failed; these count against `backoffLimit`. A deletion that leaves
    the trainer no time to save, such as `kubectl delete pod --force`, counts here too."""

    simulator: Count = 0
    """Restarts of simulators after a fault, over all attempts."""

    disruption: Count = 0
    """Pods replaced after a disruption (preemption, eviction, drain), or after a deletion that left the
    trainer time to save; these do not count against `backoffLimit`."""

    suspension: Count = 0
    """Pods replaced because the job was suspended and resumed."""

    operator: Count = 0
    """Pods that the operator replaced because the kubelet does not repair them (`TrainerNotStarted`,
    `RestartPolicyDropped`, `Stalled`); and pods whose trainer the kubelet ended because a probe failed
    (`ProbeFailed`). Pods also count here if a container of another program kept them alive after the
    trainer's end. The count is at most `backoffLimit`."""


class PodReference(StatusModel):
    """The pod of the current attempt."""

    name: Word
    """Name of the pod, for `kubectl logs`."""

    uid: Word
    """UID of the pod."""

    created: datetime = Field(strict=False)
    """Time at which the pod was created."""


class LostPart(StrEnum):
    """The part of a run that is lost."""

    CLAIM = "Claim"
    RUN_DIRECTORY = "RunDirectory"


class LostRun(StatusModel):
    """A run that had trained and is lost."""

    what: LostPart = Field(strict=False)
    """`Claim`: the claim of the replica does not exist. `RunDirectory`: the run directory was empty when a
    later attempt began."""

    step: Count
    """Step of the run's newest checkpoint; without a checkpoint, the run's highest step."""

    pod: PodReference | None = None
    """Newest pod of the lost run; absent: none is known."""

    restarted: datetime | None = Field(default=None, strict=False)
    """Time at which the operator let the replica begin again, because a person set the annotation
    `palaestra.dev/restart-lost-runs`. Absent: the replica waits for a person."""


class SimulatorStatus(StatusModel):
    """One simulator of a replica, as the trainer reports it."""

    name: Word
    """Group and number: `collect-0`."""

    role: Role = Field(strict=False)
    """`Collect` or `Evaluate`."""

    state: SidecarState = Field(strict=False)
    """`idle`, `starting`, `ready`, `stopping` or `failed`."""

    restarts: Count = 0
    """Restarts after a fault in this attempt; recycling is not counted."""

    last_fault: Sentence | None = None
    """Last fault, in a sentence; absent: none in this attempt."""

    flapping: bool = False
    """Whether the simulator fails repeatedly: it was restarted after faults three times or more within
    `restart.withinSeconds`. The value stays `true` for 600 seconds after the last of these restarts."""

    given_up: bool = False
    """Whether the simulator has used up its restarts and training continues without it."""

    standby: Word | None = None
    """State of the simulator's standby, `starting` or `ready`; absent while no standby runs."""


class SuccessInterval(StatusModel):
    """The 95 % interval (Wilson) of a success rate."""

    low: Fraction
    """Lower bound, 0 to 1."""

    high: Fraction
    """Upper bound, 0 to 1."""

    episodes: Count
    """Number of episodes from which the interval was computed."""


class ReplicaStatus(StatusModel):
    """One training run."""

    index: Count
    """Number of the replica, from 0."""

    phase: Phase = Field(default=Phase.PENDING, strict=False)
    """Phase of the replica; `Succeeded` and `Failed` are final."""

    reason: Word | None = None
    """Reason for the phase, in one word for programs; absent: none."""

    message: Sentence | None = None
    """Reason for the phase, in a sentence for people; absent: none."""

    since: datetime | None = Field(default=None, strict=False)
    """Time of the last change of `phase` or `reason`; absent: not observed yet."""

    attempt: Count = 0
    """Number of the current pod, from 1; 0: no pod yet."""

    pod: PodReference | None = None
    """Pod of the current attempt; absent: no pod yet."""

    node: Word | None = None
    """Node of the newest pod; absent: no node has been chosen yet."""

    step: Count | None = None
    """Environment steps trained; absent: not known yet."""

    target: Count | None = None
    """Environment steps at which training ends; absent: not known yet."""

    success_rate: Fraction | None = None
    """Share of successful episodes in the last evaluation or confirmation, 0 to 1; after the training, of the
    best policy. Absent: no evaluation yet, or the environment reports no success."""

    success_interval: SuccessInterval | None = None
    """Interval (Wilson, 95 %) for the true success rate of the policy; absent: `successRate` is absent."""

    mean_return: float | None = None
    """Mean return of recent training episodes; absent: no episode has ended yet."""

    last_evaluation: LastEvaluation | None = None
    """Newest evaluation; absent: none yet, or the trainer's release does not report it."""

    steps_per_second: Annotated[float, Field(ge=0)] | None = None
    """Recent environment steps per second; absent: not known, or not running."""

    simulators: Annotated[Listed[SimulatorStatus], Field(max_length=32), KNOWN_ITEMS] = ()
    """Simulators of the replica; empty: not known yet."""

    last_checkpoint: LastCheckpoint | None = None
    """Newest checkpoint; absent: none yet."""

    last_progress: datetime | None = Field(default=None, strict=False)
    """Time of the last step of training or evaluation, by the operator's clock. The field is for people; no
    timeout uses it. Absent: the current attempt has not started to train."""

    furthest_step: Count | None = None
    """Highest step of all attempts. A new attempt resumes from the last checkpoint, whose step may be lower.
    Absent: not known yet."""

    fruitless: Count = 0
    """Number of pods that were disrupted, or deleted with time to save, since `furthestStep` last rose;
    limited by `noProgressLimit`. Counting starts after the first reported step. Pods whose trainer never ran
    are not counted."""

    simulator_restarts: Count = 0
    """Number of restarts of simulators after faults in the current attempt."""

    restarts: Restarts = Restarts()
    """Restarts, by cause."""

    last_attempt: LastAttempt | None = None
    """End of the newest attempt that has ended; absent: none has ended."""

    memory_kills: Annotated[Listed[MemoryKills], Field(max_length=64)] = ()
    """Containers that were killed because they ran out of memory; empty: none."""

    faults: Faults | None = None
    """Faults of the simulators by kind, over all attempts; absent: not known yet."""

    goodput: Goodput | None = None
    """Seconds that the trainer has spent on each activity, over all attempts; absent: not known yet."""

    steps_lost: Count | None = None
    """Environment steps that were lost, over all attempts: steps of episodes that a fault ended early, and
    steps after the checkpoint from which an attempt resumed. Absent: not known yet."""

    lost: LostRun | None = None
    """The run that the replica lost last; absent: none."""


class Release(StatusModel):
    """The images for containers without an image of their own, fixed when the job was accepted."""

    trainer: Image
    """Image of the trainer and the ROS master."""

    stub: Image
    """Image of the stub simulator."""

    mujoco: Image
    """Image of the MuJoCo simulator."""

    webots: Image
    """Image of Webots; used only if the installation names an image of Webots."""


class Status(StatusModel):
    """Status of a TrainingJob, written by the operator only."""

    observed_generation: Count | None = None
    """Generation of the spec to which this status applies; 0 or absent: not reconciled yet."""

    phase: Phase | None = Field(default=None, strict=False)
    """Phase of the job; absent: not reconciled yet."""

    release: Release | None = None
    """Images of the release that accepted the job; they never change afterwards. Absent: not accepted yet."""

    conditions: Annotated[
        Listed[Condition],
        Field(
            max_length=16,
            json_schema_extra={
                "x-kubernetes-list-type": "map",
                "x-kubernetes-list-map-keys": ["type"],
            },
        ),
        KNOWN_ITEMS,
    ] = ()
    """`Accepted`, `Running`, `Suspended`, `Succeeded` and `Failed`, each with its reason; `Reconciling` while
    the job has not reached the state in its spec; `Stalled` if the job has failed or waits for a person."""

    start_time: datetime | None = Field(default=None, strict=False)
    """Time at which the first pod started, by its node's clock; absent: no pod has started."""

    completion_time: datetime | None = Field(default=None, strict=False)
    """Time at which the operator found that the last replica had ended, by the operator's clock;
    `ttlSecondsAfterFinished` counts from it. Absent: not all replicas have ended."""

    active_seconds: Count = 0
    """Seconds that the job was active before `activeSince`, without suspended time. The value is updated only
    when another field changes."""

    active_since: datetime | None = Field(default=None, strict=False)
    """Time at which `activeSeconds` was updated, by the operator's clock. Absent: the job is not accepted
    yet, is suspended, or has ended."""

    running: Word | None = None
    """Number of replicas that run or have succeeded, and number of all replicas, as `2/2`; absent: not
    reconciled yet."""

    step: Count | None = None
    """Lowest step of all replicas; absent: not known yet."""

    success_rate: Fraction | None = None
    """Lowest success rate of all replicas, 0 to 1; absent: no evaluation yet."""

    attempt: Count | None = None
    """Highest attempt of all replicas; absent: no pod yet."""

    restarts: Count | None = None
    """Largest number of pods of one replica that were replaced because the trainer failed; absent: none."""

    last_checkpoint_time: datetime | None = Field(default=None, strict=False)
    """Earliest of the times at which replicas saved their newest checkpoints; absent: no replica has one."""

    nodes: Word | None = None
    """Nodes of the newest pods, separated by commas; absent: no node has been chosen yet."""

    lost_runs_restarted: Word | None = None
    """Last value of the annotation `palaestra.dev/restart-lost-runs` that the operator obeyed; absent:
    none."""

    left_out: Words | None = None
    """Parts of the worlds that the simulators cannot simulate and have left out; each line begins with the
    name of the group. Absent: none is reported; a program of the job's own (`trainer.command`) may not report
    them."""

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
    """One entry per replica, by index; empty: not reconciled yet."""
