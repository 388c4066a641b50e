"""The TrainingJob itself."""

from typing import Annotated, Any, Final, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

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
from palaestra.api.network import Network
from palaestra.api.scheduling import Scheduling
from palaestra.api.simulators import Role, SimulatorGroup
from palaestra.api.status import Status
from palaestra.api.storage import Storage
from palaestra.api.trainer import Trainer

API_VERSION: Final = "palaestra.dev/v1alpha1"
KIND: Final = "TrainingJob"
START_TIMEOUT_S = 21_600  # a night without the registry, not a weekend
FRUITLESS_PODS = 6  # as many as Kubernetes' own default for failures
MOST_SIMULATORS = 32  # in one pod; their ports are 7100+k and 7200+k
MOST_INLINE = 900_000  # characters of all inline worlds; the plan refuses more bytes than that


# Parts of an object's metadata that a file has when it was read back from a cluster.
_WRITTEN_BY_SERVERS = frozenset(
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


class Metadata(ApiModel):
    """Name and labels of the job."""

    name: JobName
    """Name of the job: a DNS label of at most 48 characters; pods and claims are named after it."""

    namespace: Namespace = "default"
    """Namespace; `default` when absent."""

    uid: Word | None = None
    """Given by the cluster; absent for a job that was not applied to one."""

    generation: Count | None = Field(default=None, exclude=True)
    """Counts the changes of the spec; given by the cluster."""

    labels: Annotated[dict[str, Annotated[str, Field(max_length=63)]], Field(max_length=64)] = Field(
        default={}
    )
    """Labels of the TrainingJob; they are not copied to the pods."""

    annotations: Annotated[dict[str, str], Field(max_length=64)] = Field(default={})
    """Annotations of the TrainingJob; they are not copied to the pods."""

    @model_validator(mode="before")
    @classmethod
    def _drop_what_servers_write(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        if "generateName" in data and "name" not in data:
            raise PydanticCustomError("generated", "has generateName and no name; add a name")
        return {key: value for key, value in data.items() if key not in _WRITTEN_BY_SERVERS}


class PullSecret(ApiModel):
    """A Secret with which images are pulled."""

    name: ObjectName
    """Name of the Secret, in the job's own namespace."""


class Spec(ApiModel):
    """What is to be trained; everything has a default."""

    replicas: Annotated[int, Field(ge=1, le=100)] = 1
    """Independent training runs of this job, each in a pod of its own."""

    seed: Count = 1
    """Seed of replica 0; replica k has seed + k."""

    simulators: Annotated[NamedList[SimulatorGroup], Field(min_length=1, max_length=8)] = (
        SimulatorGroup(name="collect", role=Role.COLLECT),
        SimulatorGroup(name="evaluate", role=Role.EVALUATE),
    )
    """The groups of simulators in each replica; at most 32 simulators in all."""

    trainer: Trainer = Trainer()
    """What is learned, how, and for how long."""

    storage: Storage = Storage()
    """Where the run is kept."""

    suspend: bool = Field(default=False, json_schema_extra={MAY_CHANGE: True})
    """True: the pods are deleted after a checkpoint, and training goes on when it is false
    again. Refused by `palaestra run`."""

    backoff_limit: Annotated[int, Field(ge=0, le=100)] = 3
    """Failures of a replica's pod that are tried again: n failures, n + 1 pods. Disruptions by the
    cluster are not counted."""

    active_deadline_seconds: Seconds | None = Field(default=None, json_schema_extra={MAY_CHANGE: True})
    """Seconds that the job may run, suspended time not counted; absent: no bound. `palaestra run`
    counts them for each replica, anew each time it is started."""

    stall_deadline_seconds: Seconds = Field(default=600, json_schema_extra={MAY_CHANGE: True})
    """Seconds without a step that is learned from or evaluated after which a trainer ends itself and
    is tried again. It goes by the value that its replica was started with; the operator replaces the pod
    of a trainer that answers and whose step count stands two minutes longer than the value of now, at
    most `backoffLimit` times."""

    start_timeout_seconds: Seconds | None = Field(default=None, json_schema_extra={MAY_CHANGE: True})
    """Seconds that a replica may wait for its first step, for an image or a node, for instance; then it
    fails with the reason that it waits for. Absent: 21,600. Time in a queue or suspended is not counted,
    nor is that of a running trainer whose simulators are up. Once a step was made, only
    `activeDeadlineSeconds` bounds a wait.
    `palaestra run` has nothing of the kind to wait for."""

    no_progress_limit: Annotated[int, Field(ge=0, le=100)] | None = Field(
        default=None, json_schema_extra={MAY_CHANGE: True}
    )
    """Pods in a row that the cluster may take without one new step before the replica fails; absent: 6,
    0: any number. Counted once a step was reported, and only for pods whose trainer ran."""

    ttl_seconds_after_finished: Annotated[int, Field(ge=0, le=315_360_000)] | None = Field(
        default=None, json_schema_extra={MAY_CHANGE: True}
    )
    """Seconds after its end when the TrainingJob is deleted; absent: never."""

    scheduling: Scheduling = Scheduling()
    """Where and when the pods run."""

    network: Network = Network()
    """Whom the pods may talk to."""

    image_pull_secrets: Annotated[NamedList[PullSecret], Field(max_length=8)] = ()
    """Secrets with which the pod's images are pulled."""

    managed_by: Annotated[str, Field(min_length=1, max_length=63, pattern=QUALIFIED)] | None = None
    """Controller that looks after this job, as `example.com/name`; absent: Palaestra's operator,
    which leaves a job with another value alone."""

    @property
    def start_timeout_s(self) -> int:
        """Return how long a replica may wait for its first step."""
        return START_TIMEOUT_S if self.start_timeout_seconds is None else self.start_timeout_seconds

    @property
    def most_fruitless(self) -> int:
        """Return how many pods in a row may be taken without a step; 0: any number."""
        return FRUITLESS_PODS if self.no_progress_limit is None else self.no_progress_limit

    rules = (
        Rule(
            field="simulators",
            holds=lambda spec: any(group.role is Role.COLLECT for group in spec.simulators),
            cel="self.simulators.exists(group, group.role == 'Collect')",
            message="none of them collects; add a group with role Collect",
        ),
        Rule(
            field="simulators",
            holds=lambda spec: sum(group.count for group in spec.simulators) <= MOST_SIMULATORS,
            cel="self.simulators.map(group, group.count).sum() <= 32",
            message="more than 32 simulators in one pod; lower the counts or use replicas",
        ),
        Rule(
            field="simulators",
            holds=lambda spec: sum(len(group.world.inline or "") for group in spec.simulators) <= MOST_INLINE,
            cel="self.simulators.map(group, has(group.world.inline) ? size(group.world.inline) : 0).sum()"
            " <= 900000",
            message="their inline worlds have more than 900,000 characters; put the worlds into the images"
            " and name them with world.file",
        ),
        Rule(
            field="trainer.evaluation",
            holds=lambda spec: (
                spec.trainer.evaluation.every_steps == 0
                or any(group.role is Role.EVALUATE for group in spec.simulators)
            ),
            cel="self.trainer.evaluation.everySteps == 0"
            " || self.simulators.exists(group, group.role == 'Evaluate')",
            message="no simulator evaluates; add a group with role Evaluate, or set everySteps: 0",
        ),
        Rule(
            field="suspend",
            holds=lambda spec: not (spec.suspend and spec.scheduling.queue_name is not None),
            cel="!(self.suspend && has(self.scheduling.queueName))",
            message="Kueue suspends a job that has a queueName; remove one of them",
        ),
    )


class TrainingJob(ApiModel):
    """A training of a robot's policy: simulators, a trainer, and where the run is kept."""

    api_version: Literal["palaestra.dev/v1alpha1"] = API_VERSION
    """`palaestra.dev/v1alpha1`."""

    kind: Literal["TrainingJob"] = KIND
    """`TrainingJob`."""

    metadata: Metadata
    """Name and labels of the job."""

    spec: Spec
    """What is to be trained."""

    status: Status = Status()
    """What the operator tells about it; never written by its author."""
