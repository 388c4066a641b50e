"""The newest readings of a robot, each with its time."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace

import numpy as np
import structlog
from numpy.typing import NDArray

from palaestra_trainer.real_robots.safety import STANDING
from palaestra_trainer.robots.geometry import Pose, Twist

log = structlog.get_logger(__name__)


@dataclass(frozen=True, slots=True)
class Odometry:
    """A pose in the frame of odometry, and a velocity in the robot's frame (m/s, m/s, rad/s)."""

    pose: Pose
    velocity: Twist = STANDING


@dataclass(frozen=True, slots=True, kw_only=True)
class Readings:
    """The newest readings; a kind of reading that has not arrived is None.

    Attributes:
        odometry: the newest odometry.
        distances_m: meters to the nearest obstacle, shape (9,), counter-clockwise from forward.
        bumped: whether the bumper touches something.
        image: the newest image of the camera, RGB; None if no camera is in use.
        odometry_s, distances_s, bumped_s, image_s: the times of these readings on the robot's clock. Without
            a camera in use, `image_s` is infinite.
    """

    odometry: Odometry | None = None
    distances_m: NDArray[np.float32] | None = None
    bumped: bool | None = None
    odometry_s: float = -math.inf
    distances_s: float = -math.inf
    bumped_s: float = -math.inf
    image: NDArray[np.uint8] | None = None
    image_s: float = math.inf

    @property
    def oldest_s(self) -> float:
        """The time of the oldest reading; minus infinity if a kind has not arrived."""
        return min(self.odometry_s, self.distances_s, self.bumped_s, self.image_s)


class ReadingStore:
    """Holds the newest readings; any thread may read and write.

    Attributes:
        image_fault: the reason that no image has arrived, or that a picture did not become an image.
    """

    def __init__(self) -> None:
        self.image_fault = "no camera is in use"
        self._lock = threading.Lock()
        self._newest = Readings()

    @property
    def newest(self) -> Readings:
        """The newest readings of all kinds."""
        with self._lock:
            return self._newest

    def set_odometry(self, odometry: Odometry, at_s: float) -> None:
        """Store odometry of a time; older odometry than the stored one is ignored."""
        with self._lock:
            if at_s >= self._newest.odometry_s:
                self._newest = replace(self._newest, odometry=odometry, odometry_s=at_s)

    def set_distances(self, distances_m: NDArray[np.float32], at_s: float) -> None:
        """Store distances of a time."""
        with self._lock:
            if at_s >= self._newest.distances_s:
                self._newest = replace(self._newest, distances_m=distances_m, distances_s=at_s)

    def set_bumped(self, at_s: float, *, bumped: bool) -> None:
        """Store the state of the bumper at a time."""
        with self._lock:
            if at_s >= self._newest.bumped_s:
                self._newest = replace(self._newest, bumped=bumped, bumped_s=at_s)

    def set_image(self, image: NDArray[np.uint8], at_s: float) -> None:
        """Store an image of a time; from the first image on, `oldest_s` also includes the image's time."""
        with self._lock:
            if self._newest.image is None or at_s >= self._newest.image_s:
                self._newest = replace(self._newest, image=image, image_s=at_s)

    def refuse_image(self, fault: str) -> None:
        """Set the reason that a picture does not become an image; each new reason is logged once."""
        if fault != self.image_fault:
            log.warning("no image", error=fault)
        self.image_fault = fault
