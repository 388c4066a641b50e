"""The TrainingJob: metadata, spec and status."""

from enum import StrEnum
from typing import Annotated, Any, Final, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from palaestra.api.container import Resources
from palaestra.api.fields import (
    MAY_CHANGE,
    QUALIFIED,
    Count,
    JobName,
    NamedList,
    Namespace,
    ObjectName,
    Seconds,
    Word,
)
from palaestra.api.model import ApiModel, Rule
from palaestra.api.scheduling import Scheduling
from palaestra.api.simulators import SimulatorGroup
from palaestra.api.status import Status
from palaestra.api.storage import Storage
from palaestra.api.trainer import Collection, Trainer
from palaestra_protocol.pod.enums import Role

API_VERSION: Final = "palaestra.dev/v1alpha1"
KIND: Final = "TrainingJob"
# Six hours: a job survives a short outage of the image registry, but not an outage of a weekend.
START_TIMEOUT_S = 21_600

FRUITLESS_PODS = 6  # Equal to Kubernetes' default backoffLimit.

MOST_SIMULATORS = 32  # The limit for one pod. Simulator k of a pod uses the ports 7100+k and 7200+k.

# Shipped environments without a batched form. If a user's environment lacks this form, the trainer refuses
# the environment before a simulator starts.
NOT_BATCHED = ("SeeTarget-v0", "MoveToTargetGoalEnv-v0", "Deliver-v0", "Navigate-v0")

MOST_INLINE = 900_000  # Characters of all inline worlds together; the plan also limits their bytes.


# The API server writes these fields of metadata, so a file from `kubectl get -o yaml` contains them.
_SERVER_FIELDS = frozenset(
    {
        "creationTimestamp",
        "deletionGracePeriodSeconds",
        "deletionTimestamp",
        "finalizers",
        "generateName",
        "managedFields",
        "ownerReferences",
        "resourceVersion",
        "selfLink",
    }
)


class Egress(StrEnum):
    """Whether the pods may open connections."""

    OPEN = "Open"
    CLOSED = "Closed"


class Network(ApiModel):
    """Connections that the pods may open; a job cannot change which connections reach its pods."""

    egress: Egress = Field(default=Egress.OPEN, strict=False)
    """`Open`: the pods may connect to anything. `Closed`: the pods may connect to nothing, not even to DNS;
    the built-in loop needs no connection."""


class Metadata(ApiModel):
    """Name and labels of the job."""

    name: JobName
    """Name of the job: a DNS label of at most 48 characters. Names of pods and claims begin with it."""

    namespace: Namespace = "default"
    """Namespace; `default` when absent."""

    uid: Word | None = None
    """UID, set by the API server; absent in a job that was not applied to a cluster."""

    generation: Count | None = Field(default=None, exclude=True)
    """Generation of the spec, set by the API server."""

    labels: Annotated[dict[str, Annotated[str, Field(max_length=63)]], Field(max_length=64)] = Field(
        default={}
    )
    """Labels of the TrainingJob; they are not copied to the pods."""

    annotations: Annotated[dict[str, str], Field(max_length=64)] = Field(default={})
    """Annotations of the TrainingJob; they are not copied to the pods."""

    @model_validator(mode="before")
    @classmethod
    def _drop_server_fields(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        if "generateName" in data and "name" not in data:
            raise PydanticCustomError("generated", "has generateName and no name; add a name")
        return {key: value for key, value in data.items() if key not in _SERVER_FIELDS}


class PullSecret(ApiModel):
    """A Secret for pulling images.

    The Secret must have the label `palaestra.dev/for-jobs: "true"`. Otherwise an author of TrainingJobs could
    run images to which they have no access.
    """

    name: ObjectName
    """Name of the Secret, in the job's own namespace."""


class RosMaster(ApiModel):
    """The ROS master of a replica, and the container that copies the sidecar into images of your own."""

    resources: Resources = Resources()
    """CPU and memory of the ROS master's container. With driver `command`, the container `install-sidecar`
    has the same resources; it ends before the ROS master starts."""


class Spec(ApiModel):
    """The desired training; every field has a default."""

    replicas: Annotated[int, Field(ge=1, le=100)] = 1
    """Number of independent training runs, each in its own pod."""

    seed: Count = 1
    """Random seed of replica 0; replica k uses seed + k."""

    simulators: Annotated[NamedList[SimulatorGroup], Field(min_length=1, max_length=8)] = (
        SimulatorGroup(name="collect", role=Role.COLLECT),
        SimulatorGroup(name="evaluate", role=Role.EVALUATE),
    )
    """Groups of simulators; a replica has all groups, with at most 32 simulators together."""

    ros_master: RosMaster | None = None
    """Resources of the ROS master; absent: the installation's defaults, or else Palaestra's."""

    trainer: Trainer = Trainer()
    """The task, the algorithm and the length of training."""

    storage: Storage = Storage()
    """Volume for the run directory."""

    suspend: bool = Field(default=False, json_schema_extra={MAY_CHANGE: True})
    """`true` saves a checkpoint and deletes the pods; `false` resumes training from that checkpoint.
    `palaestra run` refuses `true`."""

    backoff_limit: Annotated[int, Field(ge=0, le=100)] = 3
    """Number of times that a failed pod of a replica is retried: n retries mean at most n + 1 failed pods.
    Disruptions by the cluster are not counted."""

    active_deadline_seconds: Seconds | None = Field(default=None, json_schema_extra={MAY_CHANGE: True})
    """Seconds that the job may be active, without suspended time; absent: no limit. `palaestra run` applies
    the limit to each replica, and each run of the command starts counting at 0."""

    stall_deadline_seconds: Seconds = Field(default=600, json_schema_extra={MAY_CHANGE: True})
    """Seconds without a training or evaluation step after which the trainer exits and is retried. The trainer
    uses the value with which its replica was started. If a trainer has taken no step for the current value
    plus two minutes but still responds, the operator replaces its pod, at most `backoffLimit` times."""

    start_timeout_seconds: Seconds | None = Field(default=None, json_schema_extra={MAY_CHANGE: True})
    """Seconds that a replica may wait for its first step, for example for an image or a node. After that, the
    replica fails with the reason for which it waited. Absent: 21,600. Time in a queue, suspended time, and
    time in which the trainer and its simulators run are not counted. After the first step, only
    `activeDeadlineSeconds` limits a wait. In each pod, this value also limits the seconds from the start of a
    container to its first response, for the ROS master and for the trainer; a later change does not affect
    this limit. `palaestra run` uses the field only for this limit, and allows at most 600."""

    no_progress_limit: Annotated[int, Field(ge=0, le=100)] | None = Field(
        default=None, json_schema_extra={MAY_CHANGE: True}
    )
    """Number of pods without progress at which the replica fails. A pod counts if it was disrupted, or
    deleted with time to save, since `furthestStep` in the status last rose. Absent: 6; 0: no limit. Counting
    starts after the first reported step. Pods whose trainer never ran are not counted. `palaestra run`
    ignores this field; its limit is 5."""

    ttl_seconds_after_finished: Annotated[int, Field(ge=0, le=315_360_000)] | None = Field(
        default=None, json_schema_extra={MAY_CHANGE: True}
    )
    """Seconds from the job's end until the TrainingJob is deleted; absent: never deleted."""

    scheduling: Scheduling = Scheduling()
    """Queue, priority, nodes and metadata of the pods."""

    network: Network = Network()
    """Network access of the pods."""

    image_pull_secrets: Annotated[NamedList[PullSecret], Field(max_length=8)] = ()
    """Secrets for pulling the images of the job's pods."""

    managed_by: Annotated[str, Field(min_length=1, max_length=63, pattern=QUALIFIED)] | None = None
    """Controller that reconciles this job, as `example.com/name`; absent: `palaestra.dev/operator`, which is
    Palaestra's operator. This operator ignores jobs with any other value."""

    @property
    def start_timeout_s(self) -> int:
        """Return the seconds that a replica may wait for its first step."""
        return START_TIMEOUT_S if self.start_timeout_seconds is None else self.start_timeout_seconds

    @property
    def most_fruitless(self) -> int:
        """Return the limit of disrupted or interrupted pods since the last new step; 0: no limit."""
        return FRUITLESS_PODS if self.no_progress_limit is None else self.no_progress_limit

    rules = (
        Rule(
            field="simulators",
            holds=lambda spec: any(group.role is Role.COLLECT for group in spec.simulators),
            cel="self.simulators.exists(group, group.role == 'Collect')",
            message="no group has role Collect; add one",
        ),
        Rule(
            field="simulators",
            holds=lambda spec: sum(group.count for group in spec.simulators) <= MOST_SIMULATORS,
            cel="self.simulators.map(group, group.count).sum() <= 32",
            message="has more than 32 simulators in one pod; lower the counts or use replicas",
        ),
        Rule(
            field="simulators",
            holds=lambda spec: sum(len(group.world.inline or "") for group in spec.simulators) <= MOST_INLINE,
            cel="self.simulators.map(group, has(group.world.inline) ? size(group.world.inline) : 0).sum()"
            " <= 900000",
            message="the inline worlds have more than 900,000 characters together; put the worlds into the"
            " images and name them with world.file",
        ),
        Rule(
            field="trainer.evaluation",
            holds=lambda spec: (
                spec.trainer.evaluation.every_steps == 0
                or any(group.role is Role.EVALUATE for group in spec.simulators)
            ),
            cel="self.trainer.evaluation.everySteps == 0"
            " || self.simulators.exists(group, group.role == 'Evaluate')",
            message="no group has role Evaluate; add one, or set everySteps: 0",
        ),
        Rule(
            field="trainer.initialPolicy",
            holds=lambda spec: spec.trainer.initial_policy is None or spec.storage.resume_from is None,
            cel="!has(self.trainer.initialPolicy) || !has(self.storage.resumeFrom)",
            message="cannot be combined with storage.resumeFrom; remove one of them",
        ),
        Rule(
            field="simulators",
            holds=lambda spec: (
                not any(group.batch for group in spec.simulators)
                or sum(group.role is Role.COLLECT for group in spec.simulators) == 1
            ),
            cel="!self.simulators.exists(group, has(group.batch))"
            " || self.simulators.filter(group, group.role == 'Collect').size() == 1",
            message="a group with batch must be the only one with role Collect; remove the others",
        ),
        Rule(
            field="trainer.command",
            holds=lambda spec: not (spec.trainer.command and any(group.batch for group in spec.simulators)),
            cel="size(self.trainer.command) == 0 || !self.simulators.exists(group, has(group.batch))",
            message="cannot be combined with simulators[].batch; remove one of them",
        ),
        Rule(
            field="trainer.collection",
            holds=lambda spec: (
                spec.trainer.collection is not Collection.ASYNCHRONOUS
                or not any(group.batch for group in spec.simulators)
            ),
            cel="!has(self.trainer.collection) || self.trainer.collection != 'Asynchronous'"
            " || !self.simulators.exists(group, has(group.batch))",
            message="Asynchronous is for several simulators; remove it, or remove simulators[].batch",
        ),
        Rule(
            field="trainer.environment.id",
            holds=lambda spec: (
                spec.trainer.environment.id not in NOT_BATCHED
                or not any(group.batch for group in spec.simulators)
            ),
            cel=f"!(self.trainer.environment.id in {list(NOT_BATCHED)})"
            " || !self.simulators.exists(group, has(group.batch))",
            message="has no batched form; choose MoveToTargetEnv-v0 or a batched environment of your own, or"
            " remove simulators[].batch",
        ),
        Rule(
            field="suspend",
            holds=lambda spec: not (spec.suspend and spec.scheduling.queue_name is not None),
            cel="!(self.suspend && has(self.scheduling.queueName))",
            message="cannot be true with queueName, because Kueue then suspends and resumes the job;"
            " remove one of them",
        ),
    )


class TrainingJob(ApiModel):
    """Training of a robot policy: simulators, a trainer, and a volume for the run."""

    api_version: Literal["palaestra.dev/v1alpha1"] = API_VERSION
    """`palaestra.dev/v1alpha1`."""

    kind: Literal["TrainingJob"] = KIND
    """`TrainingJob`."""

    metadata: Metadata
    """Name and labels of the job."""

    spec: Spec
    """Desired training."""

    status: Status = Status()
    """Status, written by the operator only."""
