"""The layout: the settings of a plan that differ between a cluster and a laptop, such as ports and paths.

`plan` receives a layout as its input; no program edits the planned objects later.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from palaestra.errors import PlanError
from palaestra.plan.resources import NO_DEFAULTS, Defaults

ROS_MASTER_PORT = 11311  # the port that ROS 1 tools expect
STATUS_PORT = 9090
CONTROL_PORTS = range(7100, 7200)  # one port for each simulator of a pod; a pod has at most 32 simulators
HEALTH_PORTS = range(7200, 7300)
# SIGTERM ends process 1 of a container only if the process has a handler, and rosmaster has no handler. So
# bash is process 1. Otherwise a deleted pod would exist for its whole grace period.
ROSMASTER = ("bash", "-c", "trap 'kill $!; exit' TERM; rosmaster --core -p {port} & wait $!")
OWN_ROS_MASTER = ("palaestra-ros-master", "--listen=127.0.0.1:{port}")
USER = 65532  # uid, gid and fsGroup of all containers in a pod, as in the images


@dataclass(frozen=True, slots=True, kw_only=True)
class Ports:
    """The ports of one replica; `control` and `health` are indexed by the simulator's number in the pod."""

    ros_master: int = ROS_MASTER_PORT
    status: int = STATUS_PORT
    control: Sequence[int] = CONTROL_PORTS
    health: Sequence[int] = HEALTH_PORTS


@dataclass(frozen=True, slots=True, kw_only=True)
class Images:
    """The release's images, for jobs that do not name images."""

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
    """The absolute paths in the containers of one replica.

    The claim is mounted at `volume`, and `run` is the run directory on this claim. `home` is set if the
    image's own home is read-only. `shared_memory` is set if the shared memory of a container is by default
    too small for a simulator. `sidecar` is set if `palaestra-sidecar` must be copied into a user's image. A
    claim with an initial policy is mounted at `initial`.
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
    """The values that an installation allows in those settings of a job that affect other users.

    In the tuples of keys, an entry that ends in `/` is a domain, and allows every key of this domain.

    Attributes:
        pod_labels: keys of labels that jobs may give their pods.
        pod_annotations: keys of annotations that jobs may give their pods.
        priority_classes: names of allowed priority classes.
        runtime_classes: names of allowed runtime classes.
        tolerations: keys of taints that jobs may tolerate.
        affinity_namespaces: namespaces, besides the job's own, to whose pods a job may have an affinity.
        anti_affinity_labels: keys of labels by which a required anti-affinity may select pods of other jobs.
    """

    pod_labels: tuple[str, ...] = ()
    pod_annotations: tuple[str, ...] = ()
    priority_classes: tuple[str, ...] = ()
    runtime_classes: tuple[str, ...] = ()
    tolerations: tuple[str, ...] = ()
    affinity_namespaces: tuple[str, ...] = ()
    anti_affinity_labels: tuple[str, ...] = ()


class Layout(Protocol):
    """The interface of the two layouts, `ClusterLayout` and `LocalLayout`."""

    @property
    def images(self) -> Images:
        """The images for jobs that do not name images."""
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
    def ros_hostname(self) -> str:
        """The name under which the ROS nodes of a pod reach each other."""
        ...

    @property
    def health_host(self) -> str:
        """The address at which health and metrics are served."""
        ...

    @property
    def longest_start_s(self) -> int | None:
        """The limit for the start of a container in seconds; None: only the job's own limit applies."""
        ...

    @property
    def operator_namespace(self) -> str | None:
        """The operator's namespace, whose pods may connect to trainers; None if pods share a network."""
        ...

    @property
    def monitoring_namespace(self) -> str | None:
        """The namespace whose pods may scrape metrics; None if pods share a network."""
        ...

    @property
    def node_selector(self) -> Mapping[str, str]:
        """Labels that the node of every pod must have, unless the job sets such a label itself."""
        ...

    @property
    def host_users(self) -> bool:
        """Whether pods use the user IDs of their nodes; False: each pod has a user namespace."""
        ...

    @property
    def resources(self) -> Defaults:
        """Requests and limits of containers for which a job does not set resources."""
        ...

    @property
    def user(self) -> int | None:
        """The user and group ID of a pod; None: the cluster chooses both, as OpenShift does."""
        ...

    def places(self, uid: str, replica: int, container: str) -> ContainerPaths:
        """Return the paths for a container of a replica of the job with `uid`."""
        ...

    def another_run(self, uid: str, replica: int) -> str:
        """Return the run directory of a replica of another job, which has this `uid`, on the same volume.

        Raises:
            PlanError: in this layout, jobs cannot share a volume.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterLayout:
    """The layout of a cluster: a pod has its own network and file system, so ports and paths are fixed.

    `has_webots_image` is False if the installation names no image of Webots. The operator then accepts no job
    that needs this image.
    """

    images: Images
    ports: Ports = Ports()
    ros_master: Sequence[str] = ROSMASTER
    ros_hostname: str = "localhost"
    health_host: str = "0.0.0.0"
    longest_start_s: None = None
    operator_namespace: str = "palaestra-system"
    monitoring_namespace: str = "monitoring"
    node_selector: Mapping[str, str] = field(default_factory=dict)
    host_users: bool = True
    allowed: Allowed = Allowed()
    resources: Defaults = NO_DEFAULTS
    user: int | None = USER
    has_webots_image: bool = True

    def places(self, uid: str, replica: int, container: str) -> ContainerPaths:
        """Return the same paths for every container; the job's uid separates the runs on one volume."""
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
        """Return the folder of this run on the volume."""
        return f"/var/lib/palaestra/{uid}/{replica}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalLayout:
    """The layout of a laptop: all files are in the run directory, and all ports on loopback.

    `job_directory` is the absolute folder of the job's replicas, `<dir>/<job name>`.
    """

    images: Images
    job_directory: str
    ports: Ports = Ports()
    ros_master: Sequence[str] = OWN_ROS_MASTER
    # This is an address and not a name, because a minimal chroot has no /etc/hosts that defines localhost.
    ros_hostname: str = "127.0.0.1"
    health_host: str = "127.0.0.1"
    # This limit is short, because a person waits, and the start includes no image pull and no mount.
    longest_start_s: int = 600
    operator_namespace: None = None
    monitoring_namespace: None = None
    node_selector: Mapping[str, str] = field(default_factory=dict)
    host_users: bool = True
    resources: Defaults = NO_DEFAULTS
    user: int = USER

    def places(self, uid: str, replica: int, container: str) -> ContainerPaths:
        """Return the paths of one container, all below `<job_directory>/<replica>`."""
        run = f"{self.job_directory}/{replica}"
        return ContainerPaths(
            config=run,
            volume=run,
            run=run,
            scratch=f"{run}/scratch/{container}",
            termination=f"{run}/termination.json",
        )

    def another_run(self, uid: str, replica: int) -> str:
        """Raise an error, because a laptop has no claims."""
        raise PlanError(
            "spec.storage.resumeFrom: names a run on a claim of a cluster, but this machine has no claims; "
            "remove it. A job that is run again resumes from its own run directory; to "
            "prolong the run, raise spec.trainer.steps"
        )
