"""The services of one controller by path; a service is created at its first use."""

from __future__ import annotations

import math
from typing import Any

from palaestra_trainer.errors import WrongData
from palaestra_trainer.ros import RosService


class Services:
    """The services of one robot's controller.

    Args:
        node_name: the ROS name of the controller, e.g. robotino
    """

    def __init__(self, node_name: str) -> None:
        self.node_name = node_name
        self._services: dict[str, RosService] = {}

    def get(self, path: str, type_name: str) -> RosService:
        """Return the service at `path`, relative to the node, of type webots_ros/`type_name`."""
        service = self._services.get(path)
        if service is None:
            service = RosService(f"/{self.node_name}/{path}", f"webots_ros/{type_name}")
            self._services[path] = service
        return service

    def ask(self, path: str, type_name: str) -> Any:
        """Call a service without arguments, and return the `value` of its response."""
        return self.get(path, type_name)(ask=True).value

    def call_once(self, path: str, type_name: str, **request: Any) -> Any:
        """Call a service and return its response, without a connection that stays open."""
        service = RosService(f"/{self.node_name}/{path}", f"webots_ros/{type_name}")
        try:
            return service(**request)
        finally:
            service.close()

    def confirm(self, path: str, type_name: str, refused: str, **request: Any) -> None:
        """Call a service whose response only confirms the request.

        Args:
            path: the path of the service, relative to the node.
            type_name: the name of its type, without the package.
            refused: the fact for the error if the simulator does not confirm.
            request: the fields of the request.

        Raises:
            WrongData: the simulator does not confirm.
            SimulatorDead, SimulatorHung: as `RosService`.
        """
        if not self.get(path, type_name)(**request).success:
            raise WrongData(self.node_name, refused)

    def require_finite(self, what: str, *numbers: float) -> None:
        """Check the numbers of a response; `what` names their meaning in the error.

        Raises:
            WrongData: a number is not finite.
        """
        if not all(map(math.isfinite, numbers)):
            raise WrongData(self.node_name, f"{what} is not finite: {numbers}")

    def require_kept(self, device: str, what: str, wanted: float, actual: float) -> None:
        """Check that the simulator has set a value of a device; its confirmation does not prove this.

        Raises:
            WrongData: the simulator ignored the value, as Webots does with some values.
        """
        if actual != wanted:
            raise WrongData(self.node_name, f"{device} ignores the {what} {wanted:g} and keeps {actual:g}")

    def close(self) -> None:
        """Close all connections."""
        for service in self._services.values():
            service.close()
