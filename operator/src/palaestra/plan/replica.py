"""One replica of a job in a layout: the input from which its objects are planned.

Names are deterministic. If a second or a restarted operator creates the same objects again, the API server
refuses the duplicates.
"""

from dataclasses import dataclass

from palaestra.api import SimulatorGroup, TrainingJob
from palaestra.errors import PlanError
from palaestra.plan.layout import ContainerPaths, Layout
from palaestra_sim.world import RunIdentity

JOB_LABEL = "palaestra.dev/job"
REPLICA_LABEL = "palaestra.dev/replica"
UID_LABEL = "palaestra.dev/job-uid"  # this label distinguishes successive jobs of the same name
# Annotation of a TrainingJob. If its value changes, each replica whose run is lost resumes from its run
# directory, or starts at step 0 if the directory is empty.
RESTART_LOST_RUNS = "palaestra.dev/restart-lost-runs"
TRAINER = "trainer"
ROS_MASTER = "ros-master"
INSTALL_SIDECAR = "install-sidecar"
SIMULATOR_PREFIX = "sim-"  # the name of a sidecar's container: this prefix and the simulator's name


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSimulator:
    """One simulator of a replica; `place` is the simulator's number in the pod, from 0."""

    group: SimulatorGroup
    identity: RunIdentity
    place: int

    @property
    def name(self) -> str:
        """Return the simulator's name, `<group>-<index>`."""
        return f"{self.group.name}-{self.identity.index}"

    @property
    def container(self) -> str:
        """Return the name of the sidecar's container."""
        return f"{SIMULATOR_PREFIX}{self.name}"

    @property
    def keeps_clock(self) -> bool:
        """Return whether the simulator publishes /clock, which only one simulator of a ROS master may do."""
        return self.place == 0


def uid_of(job: TrainingJob) -> str:
    """Return the uid of a job.

    Raises:
        PlanError: the job has no uid.
    """
    if job.metadata.uid is None:
        raise PlanError("metadata.uid: is missing; plan the job as the API server returned it")
    return job.metadata.uid


def owner(job: TrainingJob) -> dict[str, object]:
    """Return the owner reference of objects that are deleted with the TrainingJob."""
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
            PlanError: the job has no uid.
        """
        return uid_of(self.job)

    @property
    def name(self) -> str:
        """Return the name of the replica's Job, `<job>-<replica>`, which is unique in its namespace."""
        return f"{self.job.metadata.name}-{self.index}"

    @property
    def simulators(self) -> tuple[PlannedSimulator, ...]:
        """Return the replica's simulators in the order of the job's groups."""
        members = [(group, i) for group in self.job.spec.simulators for i in range(group.count)]
        return tuple(
            PlannedSimulator(group=group, identity=self._identity(group, i), place=place)
            for place, (group, i) in enumerate(members)
        )

    def places(self, container: str) -> ContainerPaths:
        """Return the paths for a container of the replica."""
        return self.layout.places(self.uid, self.index, container)

    def metadata(self, name: str, *, owned: bool = True) -> dict[str, object]:
        """Return the metadata of an object; an owned object is deleted with the TrainingJob."""
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
        """Return the labels that select the replica's objects."""
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
