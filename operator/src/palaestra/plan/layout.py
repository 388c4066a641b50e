"""What differs between a cluster and a laptop: ports, places and images. Nothing else does.

A layout is given to `plan` and only read there; nothing is edited after planning.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from palaestra.errors import PlanError
from palaestra.plan.resources import NO_DEFAULTS, Defaults

ROS_MASTER_PORT = 11311  # the port that ROS 1 tools expect
STATUS_PORT = 9090
CONTROL_PORTS = range(7100, 7200)  # of the k-th simulator of a pod; a pod has 32 at most
HEALTH_PORTS = range(7200, 7300)
# Process 1 of a container ends at a signal only if it asks for it, which rosmaster does not: without
# somebody before it, a pod would stay for its whole grace period.
ROSMASTER = ("bash", "-c", "trap 'kill $!; exit' TERM; rosmaster --core -p {port} & wait $!")
OWN_ROS_MASTER = ("palaestra-ros-master", "--listen=127.0.0.1:{port}")
USER = 65532  # uid, gid and fsGroup of everything in a pod, as in the images


@dataclass(frozen=True, slots=True, kw_only=True)
class Ports:
    """The ports of one replica; `control` and `health` are indexed by the simulator's place."""

    ros_master: int = ROS_MASTER_PORT
    status: int = STATUS_PORT
    control: Sequence[int] = CONTROL_PORTS
    health: Sequence[int] = HEALTH_PORTS


@dataclass(frozen=True, slots=True, kw_only=True)
class Images:
    """The release's own images, for jobs that name none."""

    trainer: str
    stub: str
    mujoco: str
    webots: str

    @classmethod
    def of_release(cls, version: str) -> "Images":
        """Return the images that were built for a version of Palaestra."""
        return cls(
            trainer=f"palaestra-trainer:{version}",
            stub=f"palaestra-stub:{version}",
            mujoco=f"palaestra-mujoco:{version}",
            webots=f"palaestra-webots:{version}",
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerPaths:
    """Where things lie for the containers of one replica; absolute paths.

    `volume` is where the claim is mounted and `run` the run directory on it. `home` is given where
    the image's own cannot be written, `shared_memory` where the default is too small for a simulator,
    and `sidecar` where `palaestra-sidecar` has to be copied into a user's image. A claim with an initial
    policy is mounted at `initial`.
    """

    config: str
    volume: str
    run: str
    scratch: str
    termination: str
    home: str | None = None
    shared_memory: str | None = None
    sidecar: str | None = None
    initial: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Allowed:
    """What the jobs of a cluster may ask for beyond their own pods, as its installation allows it.

    Attributes:
        pod_labels: keys of labels that jobs may give their pods, or domains that end in `/`.
        pod_annotations: the same of annotations.
        priority_classes: names.
        runtime_classes: names.
        tolerations: keys of taints, or domains that end in `/`.
        affinity_namespaces: names of namespaces to whose pods a job may have an affinity, besides its own.
        anti_affinity_labels: keys of labels by which a required anti-affinity may select pods of other jobs,
            or domains that end in `/`.
    """

    pod_labels: tuple[str, ...] = ()
    pod_annotations: tuple[str, ...] = ()
    priority_classes: tuple[str, ...] = ()
    runtime_classes: tuple[str, ...] = ()
    tolerations: tuple[str, ...] = ()
    affinity_namespaces: tuple[str, ...] = ()
    anti_affinity_labels: tuple[str, ...] = ()


class Layout(Protocol):
    """A cluster's or a laptop's."""

    @property
    def images(self) -> Images:
        """The images for jobs that name none."""
        ...

    @property
    def ports(self) -> Ports:
        """The ports of one replica."""
        ...

    @property
    def ros_master(self) -> Sequence[str]:
        """The command of the ROS master, with `{port}` for its port."""
        ...

    @property
    def health_host(self) -> str:
        """The address on which health and metrics are served."""
        ...

    @property
    def longest_start_s(self) -> int | None:
        """The seconds to which the start of a container is bounded here; None: only as the job bounds it."""
        ...

    @property
    def operator_namespace(self) -> str | None:
        """Where the operator runs, whose pods may ask the trainers; None: no pod has a network."""
        ...

    @property
    def monitoring_namespace(self) -> str | None:
        """Where metrics are gathered; None: no pod has a network."""
        ...

    @property
    def node_selector(self) -> Mapping[str, str]:
        """Labels that the node of every pod must have, unless the job gives such a label itself."""
        ...

    @property
    def host_users(self) -> bool:
        """Whether the users in a pod are those of its node; False: each pod has a user namespace."""
        ...

    @property
    def resources(self) -> Defaults:
        """Requests and limits of containers of jobs that mention none."""
        ...

    @property
    def user(self) -> int | None:
        """The user and group of a pod; None: the cluster chooses them, as OpenShift does."""
        ...

    def places(self, uid: str, replica: int, container: str) -> ContainerPaths:
        """Return where things lie for a container of a replica of the job with `uid`."""
        ...

    def another_run(self, uid: str, replica: int) -> str:
        """Return the run directory of a replica of the job with `uid`, on the same volume.

        Raises:
            PlanError: no two jobs share a volume here.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterLayout:
    """Every pod has a network and a file system of its own, so places and ports are always the same."""

    images: Images
    ports: Ports = Ports()
    ros_master: Sequence[str] = ROSMASTER
    health_host: str = "0.0.0.0"
    longest_start_s: None = None
    operator_namespace: str = "palaestra-system"
    monitoring_namespace: str = "monitoring"
    node_selector: Mapping[str, str] = field(default_factory=dict)
    host_users: bool = True
    allowed: Allowed = Allowed()
    resources: Defaults = NO_DEFAULTS
    user: int | None = USER

    def places(self, uid: str, replica: int, container: str) -> ContainerPaths:
        """Return the same places for every container; runs are kept apart by the job's uid."""
        return ContainerPaths(
            config="/etc/palaestra",
            volume="/var/lib/palaestra",
            run=self.another_run(uid, replica),
            scratch="/tmp",
            termination="/dev/termination-log",
            home="/tmp",
            shared_memory="/dev/shm",
            sidecar="/palaestra",
            initial="/initial-policy",
        )

    def another_run(self, uid: str, replica: int) -> str:
        """Return the folder that is the run's own there."""
        return f"/var/lib/palaestra/{uid}/{replica}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalLayout:
    """All containers share this machine: everything lies in the run directory, on loopback.

    `job_directory` is the absolute folder of the job's replicas, `<dir>/<job name>`.
    """

    images: Images
    job_directory: str
    ports: Ports = Ports()
    ros_master: Sequence[str] = OWN_ROS_MASTER
    health_host: str = "127.0.0.1"
    longest_start_s: int = 600  # a person waits for it, and nothing is pulled or mounted
    operator_namespace: None = None
    monitoring_namespace: None = None
    node_selector: Mapping[str, str] = field(default_factory=dict)
    host_users: bool = True
    resources: Defaults = NO_DEFAULTS
    user: int = USER

    def places(self, uid: str, replica: int, container: str) -> ContainerPaths:
        """Return the places of one container, all below `<job_directory>/<replica>`."""
        run = f"{self.job_directory}/{replica}"
        return ContainerPaths(
            config=run,
            volume=run,
            run=run,
            scratch=f"{run}/scratch/{container}",
            termination=f"{run}/termination.json",
        )

    def another_run(self, uid: str, replica: int) -> str:
        """Refuse: a laptop has no claims."""
        raise PlanError(
            "spec.storage.resumeFrom: names a run on a claim of a cluster, which is not to be had here; "
            "remove it. A job that is run again resumes from its own run directory, and more "
            "spec.trainer.steps prolong it"
        )
