"""The interface of a connection to a real robot."""

from __future__ import annotations

from typing import Protocol

from palaestra_trainer.real_robots.camera import ImageSize
from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.robots.geometry import Twist


class RobotLink(Protocol):
    """A connection to one robot.

    Attributes:
        address: the address of the robot, for messages.
    """

    address: str

    def refuse_unfit(self, speed_m_s: float, turn_rad_s: float) -> None:
        """Refuse a robot that must not be driven.

        Args:
            speed_m_s: the greatest speed at which the robot is to be driven.
            turn_rad_s: the greatest rate of turning.

        Raises:
            RobotUnfit: the robot does not respond, charges, or does not allow the speed.
        """
        ...

    def start(self, store: ReadingStore) -> None:
        """Begin to put readings into `store`, in threads of the connection, until `close`."""
        ...

    def use_camera(self, store: ReadingStore, size: ImageSize) -> None:
        """Begin to put images of a size into `store`, after `start`; further calls have no effect.

        Until the first image arrives, and after each picture that cannot be converted to an image,
        `store.image_fault` has the reason.
        """
        ...

    def send(self, twist: Twist) -> None:
        """Send one velocity: forward and left in m/s, counter-clockwise in rad/s.

        Raises:
            LinkError: the robot has not confirmed the velocity.
        """
        ...

    def close(self) -> None:
        """End all threads and connections; further calls have no effect."""
        ...
