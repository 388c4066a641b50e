"""A sidecar that this program has started, and that ends with this program."""

from __future__ import annotations

from abc import ABC, abstractmethod

from palaestra_trainer.webots.launching.ros_name_locks import Reservation
from palaestra_trainer.webots.launching.sidecar import Sidecar


class OwnedSidecar(Sidecar, ABC):
    """A client of a sidecar that this program has started.

    Args:
        address: see `Sidecar`.
        name: the simulator's name, for messages.
        suffix: text that was appended to the ROS names in the world.
    """

    def __init__(self, address: str, name: str, suffix: str = "") -> None:
        super().__init__(address, name)
        self.suffix = suffix
        self._open = True
        self._reservation = Reservation()

    def reserve(self) -> bool:
        """Reserve the ROS names of this simulator until `close`; return False if a name is in use.

        Raises:
            MasterLost: no ROS master responds.
        """
        return self._reservation.take(robot.ros_name for robot in self.state().robots)

    def close(self) -> None:
        """End the sidecar and its simulator; further calls have no effect."""
        if self._open:
            self._open = False
            self._end()
            self._reservation.release()

    @abstractmethod
    def _end(self) -> None:
        """End the sidecar and its simulator; called once."""
