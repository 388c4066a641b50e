"""Run simulators in pods of a Kubernetes cluster, for a notebook in a pod of the same cluster.

Each simulator is a Job with one pod: a sidecar with its simulator, and a ROS master unless one runs. The
sidecar ends if it gets no request from this program for some time. So the Job also ends after a kill of this
program, and the cluster removes the Job. The owner of the Job is the pod of this program, so the cluster also
removes the Job when that pod is deleted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.launcher import Place
from palaestra_trainer.webots.launching.optional_package import require_package
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest

_LEAST_SILENCE_S = 10

Quantities = Mapping[str, Mapping[str, str]]

_RESOURCES: Quantities = MappingProxyType(
    {
        "requests": MappingProxyType({"cpu": "200m", "memory": "256Mi"}),
        "limits": MappingProxyType({"memory": "1Gi"}),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Kubernetes(Place):
    """Starts simulators in pods of the cluster in which this program runs.

    The service account of this program needs the rights that the chart gives with `jupyter.simulators`.

    Attributes:
        image: the image of the simulator, with `palaestra-sidecar`; by default the image of the stub or of
            MuJoCo, from the registry of this program's own image.
        resources: requests and limits of the simulator's container, as in a pod.
        start_s: the longest time until the pod responds, including the time to download images.
        silence_s: the pod ends after this number of seconds without a request from this program; at least 10.
        lifetime_s: the pod ends after this number of seconds in any case.
    """

    image: str | None = None
    resources: Quantities = field(default_factory=lambda: _RESOURCES)
    start_s: float = 300.0
    silence_s: int = 120
    lifetime_s: int = 24 * 3600

    def __post_init__(self) -> None:
        """Check the settings.

        Raises:
            ConfigurationError: `silence_s` is so short that a busy program would lose its pod.
        """
        if self.silence_s < _LEAST_SILENCE_S:
            raise ConfigurationError(
                f"launcher kubernetes: silence_s: {self.silence_s} is refused; give {_LEAST_SILENCE_S} "
                "or more"
            )

    def launch(self, request: SimulatorRequest) -> OwnedSidecar:
        """Start a sidecar in a new pod; see `Place`.

        Raises:
            ConfigurationError: the package kubernetes is missing, or this program does not run in a pod; the
                API server refuses an object; the pod does not run in time; the sidecar refused the world or
                the driver. The message has the remedy or the events of the pod.
        """
        require_package("kubernetes")
        from palaestra_trainer.webots.launching.kubernetes_pod import PodSettings, start_pod

        settings = PodSettings(
            image=self.image,
            resources=self.resources,
            start_s=self.start_s,
            silence_s=self.silence_s,
            lifetime_s=self.lifetime_s,
        )
        return start_pod(settings, request)
