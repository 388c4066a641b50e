"""One replica of a job, resolved: what all its objects are made from.

Names are deterministic, so that a second operator, or the same one after a crash, makes the same
objects again and is refused by the API server.
"""

from dataclasses import dataclass

from palaestra.api import SimulatorGroup, TrainingJob
from palaestra.errors import PlanError
from palaestra.plan.layout import ContainerPaths, Layout
from palaestra_sim.world import RunIdentity

JOB_LABEL = "palaestra.dev/job"
REPLICA_LABEL = "palaestra.dev/replica"
UID_LABEL = "palaestra.dev/job-uid"  # a job that is made again has the name of the one before
RESTART_LOST_RUNS = "palaestra.dev/restart-lost-runs"  # annotation of a TrainingJob: any new value
TRAINER = "trainer"
ROS_MASTER = "ros-master"
INSTALL_SIDECAR = "install-sidecar"
SIMULATOR_PREFIX = "sim-"  # of a container's name; the simulator's name follows


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSimulator:
    """One simulator of a replica; `place` counts all of the pod's, in the order of the job."""

    group: SimulatorGroup
    identity: RunIdentity
    place: int

    @property
    def name(self) -> str:
        """Return `<group>-<index>`."""
        return f"{self.group.name}-{self.identity.index}"

    @property
    def container(self) -> str:
        """Return the name of its sidecar's container."""
        return f"{SIMULATOR_PREFIX}{self.name}"

    @property
    def keeps_clock(self) -> bool:
        """Return whether it publishes /clock: one simulator of a ROS master at most may."""
        return self.place == 0


def uid_of(job: TrainingJob) -> str:
    """Return the uid of a job.

    Raises:
        PlanError: it has none.
    """
    if job.metadata.uid is None:
        raise PlanError("metadata.uid: is absent; plan the job as the cluster returned it")
    return job.metadata.uid


def owner(job: TrainingJob) -> dict[str, object]:
    """Return the owner reference of what goes with the TrainingJob."""
    return {
        "apiVersion": job.api_version,
        "kind": job.kind,
        "name": job.metadata.name,
        "uid": job.metadata.uid,
        "controller": True,
        "blockOwnerDeletion": True,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Replica:
    """One replica of a job in a layout."""

    job: TrainingJob
    index: int
    layout: Layout

    @property
    def uid(self) -> str:
        """Return the uid of the job.

        Raises:
            PlanError: it has none.
        """
        return uid_of(self.job)

    @property
    def name(self) -> str:
        """Return `<job>-<replica>`, the name of its Job; no two jobs of a namespace share one."""
        return f"{self.job.metadata.name}-{self.index}"

    @property
    def simulators(self) -> tuple[PlannedSimulator, ...]:
        """Return its simulators in the order of the job's groups."""
        members = [(group, i) for group in self.job.spec.simulators for i in range(group.count)]
        return tuple(
            PlannedSimulator(group=group, identity=self._identity(group, i), place=place)
            for place, (group, i) in enumerate(members)
        )

    def places(self, container: str) -> ContainerPaths:
        """Return where things lie for one of its containers."""
        return self.layout.places(self.uid, self.index, container)

    def metadata(self, name: str, *, owned: bool = True) -> dict[str, object]:
        """Return the metadata of one of its objects; what is owned goes with the TrainingJob."""
        metadata: dict[str, object] = {
            "name": name,
            "namespace": self.job.metadata.namespace,
            "labels": self.labels,
        }
        if owned:
            metadata["ownerReferences"] = [owner(self.job)]
        return metadata

    @property
    def labels(self) -> dict[str, str]:
        """Return the labels by which its objects are found."""
        return {
            "app.kubernetes.io/managed-by": "palaestra",
            JOB_LABEL: self.job.metadata.name,
            REPLICA_LABEL: str(self.index),
            UID_LABEL: self.uid,
        }

    def _identity(self, group: SimulatorGroup, index: int) -> RunIdentity:
        return RunIdentity(
            job=self.job.metadata.name,
            namespace=self.job.metadata.namespace,
            uid=self.uid,
            replica=self.index,
            group=group.name,
            index=index,
        )
