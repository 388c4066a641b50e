"""Run simulators in containers of a Docker Engine, with the Docker SDK for Python.

The program is attached to the standard input of each container. If the program ends in any way, the engine
closes this input, the sidecar in the container ends, and the engine removes the container.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from palaestra_trainer.webots.launching.launcher import Place
from palaestra_trainer.webots.launching.optional_package import require_package
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.release_images import release_image
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class Docker(Place):
    """Starts simulators in containers of the Docker Engine that DOCKER_HOST names.

    The engine needs an image with `palaestra-sidecar` and the simulator. No image is downloaded.

    Attributes:
        image: the image; by default the image of this release for the stub or MuJoCo.
        network: the network of the container: "host", or the name of a network of the engine with the driver
            bridge. Without a running ROS master, a master starts on the address of this machine in that
            network.
        shm_size: the size of /dev/shm in the container, e.g. "1g". Webots needs it for images of cameras.
        gpus: the number of GPUs of the container, or "all"; the engine needs the NVIDIA Container Toolkit.
        folder: the folder that the container can read, with all files of the world; by default the folder of
            the world, or its Webots project.
    """

    image: str | None = None
    network: str = "host"
    shm_size: str = "64m"
    gpus: int | Literal["all"] = 0
    folder: str | Path | None = None

    def launch(self, request: SimulatorRequest) -> OwnedSidecar:
        """Start a sidecar in a new container; see `Place`.

        Raises:
            ConfigurationError: the package docker is missing, no engine responds, the engine refuses the
                container, or the sidecar refused the world or the driver; the message has the remedy.
            SimulatorDead: the container printed nothing within 60 s.
        """
        require_package("docker")
        from palaestra_trainer.webots.launching.docker_container import ContainerPlan, start_container

        plan = ContainerPlan(
            image=self.image_of(request),
            network=self.network,
            shm_size=self.shm_size,
            gpus=self.gpus,
            folder=self.folder_of(request.world),
        )
        return start_container(plan, self.in_container(request))

    def image_of(self, request: SimulatorRequest) -> str:
        """Return the image for a simulator.

        Raises:
            ConfigurationError: this release has no image with the simulator.
        """
        return self.image or release_image(request.driver, launcher="docker")

    def folder_of(self, world: str | Path) -> Path | None:
        """Return the folder that a container needs for this world; None for a world in the image.

        If the file is missing, the result is None too, and the sidecar reports the missing file.
        """
        if self.folder is not None:
            return Path(self.folder).absolute()
        path = Path(world)
        if not path.is_file():
            return None
        around = path.absolute().parent
        return around.parent if around.name == "worlds" else around

    def in_container(self, request: SimulatorRequest) -> SimulatorRequest:
        """Return the request with the path that the world has in the container."""
        path = Path(request.world)
        return replace(request, world=path.absolute()) if path.is_file() else request
