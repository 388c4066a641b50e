"""Start and end a sidecar in a container of a Docker Engine."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from docker.types import DeviceRequest, Mount

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.docker_engine import connected, ended, engine_errors
from palaestra_trainer.webots.launching.docker_network import ContainerNetwork, network_of
from palaestra_trainer.webots.launching.docker_output import ContainerOutput
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.sidecar_command import control_address, sidecar_options
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest

_START_S = 60.0
_LABELS = {"palaestra.launcher": "docker"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerPlan:
    """The settings of a container, except its simulator.

    Attributes:
        image: the image of the simulator.
        network: see `Docker`.
        shm_size: see `Docker`.
        gpus: see `Docker`.
        folder: the folder that the container can read; None: the world is in the image.
    """

    image: str
    network: str
    shm_size: str
    gpus: int | Literal["all"]
    folder: Path | None


class DockerLauncher(OwnedSidecar):
    """A sidecar in a container that this program started.

    Args:
        container: the running container.
        address: see `Sidecar`.
        request: the simulator that the sidecar starts.
    """

    def __init__(self, container: Any, address: str, request: SimulatorRequest) -> None:
        super().__init__(address, Path(request.world).stem, request.suffix)
        self._container = container

    def _end(self) -> None:
        ended(self._container)
        self._container.client.close()


def start_container(plan: ContainerPlan, request: SimulatorRequest) -> DockerLauncher:
    """Start a sidecar in a new container; see `Docker.launch`.

    Args:
        plan: the settings of the container.
        request: the simulator, with the path that its world has in the container.
    """
    image = plan.image
    engine = connected()
    with ExitStack() as undo:
        undo.callback(engine.close)
        with engine_errors(image):
            network = network_of(engine, plan.network)
            container = engine.containers.create(
                image, [*network.listeners, *sidecar_options(request)], **_options(plan, network)
            )
            undo.callback(ended, container)
            output = ContainerOutput(container)
            container.start()
        port = _control_port(output, image)
        with engine_errors(image):
            address = network.address(container)
        launcher = DockerLauncher(container, f"http://{address}:{port}", request)
        undo.pop_all()
    return launcher


def _options(plan: ContainerPlan, network: ContainerNetwork) -> dict[str, Any]:
    """Return the options of `containers.create`."""
    count = -1 if plan.gpus == "all" else plan.gpus
    folder = plan.folder
    return {
        "auto_remove": True,
        "cap_drop": ["ALL"],
        "device_requests": [DeviceRequest(count=count, capabilities=[["gpu"]])] if count else [],
        "entrypoint": list(network.entrypoint),
        "environment": dict(network.environment),
        "labels": _LABELS,
        "mounts": [Mount(str(folder), str(folder), "bind", read_only=True)] if folder else [],
        "network_mode": plan.network,
        "security_opt": ["no-new-privileges"],
        "shm_size": plan.shm_size,
        "stdin_open": True,
    }


def _control_port(output: ContainerOutput, image: str) -> int:
    """Return the control port in the sidecar's first line.

    Raises:
        ConfigurationError: the sidecar, or the program of another image, ended without this line.
        SimulatorDead: nothing was printed in time.
    """
    line = output.first_line(_START_S)
    address = control_address(line)
    if address is None:
        said = output.rest() or f"{image}: the container printed {line!r}, which is not the line of a sidecar"
        raise ConfigurationError(said)
    return int(address.rpartition(":")[2])
