"""Start and end a sidecar in a pod of the cluster in which this program runs."""

from __future__ import annotations

import atexit
import os
import secrets
import threading
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from palaestra_protocol.http import Address
from palaestra_trainer.errors import ConfigurationError, MasterLost, SimulatorFault, SimulatorHung
from palaestra_trainer.ros import Master
from palaestra_trainer.webots.launching import kubernetes_api as api
from palaestra_trainer.webots.launching import kubernetes_objects as objects
from palaestra_trainer.webots.launching import kubernetes_state as state
from palaestra_trainer.webots.launching.addresses import is_loopback
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.pods_by_master import PodsByMaster
from palaestra_trainer.webots.launching.release_images import release_image
from palaestra_trainer.webots.launching.sidecar import Sidecar
from palaestra_trainer.webots.launching.sidecar_command import sidecar_options
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest

_OWN_POD = "PALAESTRA_POD"  # the chart sets it; HOSTNAME may differ from the pod's name
_POLL_S = 0.25
_REMOVED_S = 60.0
_REACHED_S = 20.0
_SIGNS_OF_LIFE = 4  # number of requests to a sidecar within `silence_s` seconds
_MOST_WORLD_BYTES = 700_000  # a ConfigMap may have 1 MiB, and base64 needs a third more
_session = secrets.token_hex(4)
_pods = PodsByMaster()


@dataclass(frozen=True, slots=True, kw_only=True)
class PodSettings:
    """The settings of a pod, with the names and meanings of `Kubernetes`."""

    image: str | None
    resources: Mapping[str, Any]
    start_s: float
    silence_s: int
    lifetime_s: int


def start_pod(settings: PodSettings, request: SimulatorRequest) -> KubernetesLauncher:
    """Start a sidecar in a new pod; see `Kubernetes.launch`."""
    cluster = api.NamespaceClient()
    with ExitStack() as undo:
        undo.callback(cluster.close)
        plan = _planned(settings, request, _notebook(cluster))
        created = cluster.create(api.JOBS, objects.job(plan))
        undo.callback(_remove, cluster, plan.name)
        if plan.world is not None:
            cluster.create(api.CONFIG_MAPS, objects.world_map(plan, plan.world, created))
        cluster.create(api.POLICIES, objects.network_policy(plan, created))
        cluster.merge(api.JOBS, plan.name, {"spec": {"suspend": False}})
        address = _address(cluster, plan.name, settings.start_s)
        if plan.master_image:
            _use_master(address, plan.notebook.address)
        launcher = KubernetesLauncher(cluster, plan, address, request)
        undo.pop_all()
    return launcher


class KubernetesLauncher(OwnedSidecar):
    """A sidecar in a pod that this program started; a thread sends it regular requests until `close`.

    Args:
        cluster: the client of the cluster.
        plan: the plan of the pod.
        address: the IP address of the pod.
        request: the simulator that the sidecar starts.
    """

    def __init__(
        self, cluster: api.NamespaceClient, plan: objects.PodPlan, address: str, request: SimulatorRequest
    ) -> None:
        url = _url(address)
        super().__init__(url, Path(request.world).stem, request.suffix)
        self._cluster = cluster
        self._pod = plan.name
        self._closed = threading.Event()
        self._address = address
        _pods.add(address, str(urlsplit(os.environ["ROS_MASTER_URI"]).hostname), self._remove)
        every_s = plan.silence_s / _SIGNS_OF_LIFE
        threading.Thread(target=_keep_alive, args=(url, self._closed, every_s), daemon=True).start()
        atexit.register(self._delete)

    def _end(self) -> None:
        removals = _pods.close(self._address)
        if self._remove not in removals:  # another pod needs this pod's ROS master
            with suppress(SimulatorFault):  # the simulator may have ended
                self.expect_stop(0.0)
        for remove in removals:
            remove()

    def _delete(self) -> None:
        """Delete the pod at the exit of this program, without waiting."""
        with suppress(ConfigurationError):  # the pod also ends by itself
            self._cluster.delete(api.JOBS, self._pod)

    def _remove(self) -> None:
        atexit.unregister(self._delete)
        self._closed.set()
        _remove(self._cluster, self._pod)
        self._cluster.close()


def _keep_alive(url: str, closed: threading.Event, every_s: float) -> None:
    sidecar = Sidecar(url, "sign of life")
    while not closed.wait(every_s):
        with suppress(SimulatorFault):  # the next call of the program reports the fault
            sidecar.state()


def _notebook(cluster: api.NamespaceClient) -> objects.Notebook:
    """Return the pod in which this program runs.

    Raises:
        ConfigurationError: this program does not run in a pod of the cluster, or the pod has no label.
    """
    name = os.environ.get(_OWN_POD) or os.environ.get("HOSTNAME", "")
    pod = cluster.get(api.PODS, name) if name else None
    if pod is None:
        raise ConfigurationError(
            f"launcher kubernetes: namespace {cluster.namespace} has no pod {name}, so this program "
            f"does not run in the cluster; run it there, set {_OWN_POD} to the name of its pod, or use "
            'launcher="process"'
        )
    notebook = objects.Notebook.from_pod(pod)
    if not notebook.labels:
        raise ConfigurationError(
            f"launcher kubernetes: pod {name} has no label, so a NetworkPolicy cannot admit this pod alone; "
            "give it a label"
        )
    return notebook


def _planned(settings: PodSettings, request: SimulatorRequest, notebook: objects.Notebook) -> objects.PodPlan:
    own_master = not _master_responds()
    world = _world_file(request.world)
    named = replace(request, world=f"{objects.WORLDS}/{world[0]}") if world else request
    return objects.PodPlan(
        name=f"palaestra-sim-{secrets.token_hex(4)}",
        session=_session,
        image=settings.image or release_image(request.driver, beside=notebook.image, launcher="kubernetes"),
        master_image=notebook.image if own_master else None,
        master_uri=f"http://127.0.0.1:{objects.MASTER_PORT}" if own_master else Master("/palaestra").uri,
        options=sidecar_options(named),
        world=world,
        notebook=notebook,
        resources=settings.resources,
        silence_s=settings.silence_s,
        lifetime_s=settings.lifetime_s,
    )


def _master_responds() -> bool:
    """Return whether a ROS master that pods can reach responds.

    Raises:
        ConfigurationError: a master responds that only this pod can reach.
    """
    master = Master("/palaestra")
    try:
        master.ping()
    except MasterLost:
        return False
    if is_loopback(str(urlsplit(master.uri).hostname)):
        raise ConfigurationError(
            f"launcher kubernetes: a pod cannot reach the ROS master at {master.uri}; start first "
            "the simulators in other pods, or start all simulators in this pod"
        )
    return True


def _world_file(world: str | Path) -> tuple[str, bytes] | None:
    """Return name and content of a world file of this program; None for a world in the image.

    Raises:
        ConfigurationError: the file cannot be read, or is too large for a ConfigMap.
    """
    path = Path(world)
    if not path.is_file():
        return None
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read ({error.strerror}); give a file") from error
    if len(content) > _MOST_WORLD_BYTES:
        raise ConfigurationError(
            f"{path}: has {len(content)} bytes, and a pod gets at most {_MOST_WORLD_BYTES}; put the world "
            "into an image, and give Kubernetes(image=...) and the path in that image"
        )
    return path.name, content


def _address(cluster: api.NamespaceClient, name: str, deadline_s: float) -> str:
    """Return the IP address of the pod when its sidecar responds.

    Raises:
        ConfigurationError: the pod cannot run, or does not respond in time; the message has the reason.
    """
    began, running_since = time.monotonic(), None
    while True:
        pods = cluster.list(api.PODS, labelSelector=f"{objects.NAME_LABEL}={name}")
        pod = pods[0] if pods else None
        if failure := state.failure_of(pod, [] if pods else _events(cluster, [name])):
            raise ConfigurationError(f"launcher kubernetes: {name}: {failure}")
        address, now = state.address_of(pod), time.monotonic()
        if address is not None:
            running_since = running_since or now
            if _responds(address):
                return address
            if now - running_since > _REACHED_S:
                raise ConfigurationError(
                    f"launcher kubernetes: {name}: this program cannot connect to {_url(address)}; allow it "
                    "in the network policies of the namespace"
                )
        elif now - began > deadline_s:
            events = _events(cluster, [name, *(each["metadata"]["name"] for each in pods)])
            raise ConfigurationError(
                f"launcher kubernetes: {name}: the pod does not run after {deadline_s:g} s "
                f"({state.told(events)}); free resources of the cluster, or give Kubernetes(start_s=...)"
            )
        time.sleep(_POLL_S)


def _events(cluster: api.NamespaceClient, names: list[str]) -> list[objects.Object]:
    return [
        event
        for name in names
        for event in cluster.list(api.EVENTS, fieldSelector=f"involvedObject.name={name}")
    ]


def _responds(address: str) -> bool:
    try:
        Sidecar(_url(address), address).state()
    except SimulatorFault:
        return False
    return True


def _url(address: str) -> str:
    return f"http://{Address(address, objects.CONTROL_PORT)}"


def _use_master(address: str, own_address: str) -> None:
    """Make the master in a pod the master of this process."""
    os.environ["ROS_MASTER_URI"] = f"http://{Address(address, objects.MASTER_PORT)}"
    if own_address:
        os.environ.pop("ROS_HOSTNAME", None)
        os.environ["ROS_IP"] = own_address


def _remove(cluster: api.NamespaceClient, name: str) -> None:
    """Remove the Job with all that belongs to it, and wait until it is gone.

    Raises:
        ConfigurationError: the API server refuses a request.
        SimulatorHung: the Job is still there after 60 s.
    """
    give_up = time.monotonic() + _REMOVED_S
    cluster.delete(api.JOBS, name)
    while cluster.get(api.JOBS, name) is not None:
        if time.monotonic() > give_up:
            raise SimulatorHung(name, f"its Job was not removed within {_REMOVED_S:g} s")
        time.sleep(_POLL_S)
