"""The TrainingJob itself."""

from typing import Annotated, Any, Final, Literal

from pydantic import Field, model_validator

from palaestra.api.fields import (
    MAY_CHANGE,
    QUALIFIED,
    Count,
    JobName,
    Label,
    NamedList,
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
MOST_SIMULATORS = 32  # in one pod; their ports are 7100+k and 7200+k


# Parts of an object's metadata that a file has when it was read back from a cluster.
_WRITTEN_BY_SERVERS = frozenset(
    {
        "creationTimestamp",
        "deletionGracePeriodSeconds",
        "deletionTimestamp",
        "finalizers",
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

    namespace: Label = "default"
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
    is tried again. It goes by the value that its replica was started with; the operator ends a
    replica for good whose step count stands two minutes longer than the value of now."""

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
