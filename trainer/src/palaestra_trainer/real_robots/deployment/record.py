"""The record of a deployment: a bag with poses, readings, commands and decisions.

The loop that commands the robot must not wait for a disk. So it only puts entries into a queue, and a thread
of the record writes them. If the disk is so slow that the queue is full, entries are dropped and counted.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Self, cast

import numpy as np
import structlog
from numpy.typing import NDArray

from palaestra_trainer.bags import messages
from palaestra_trainer.bags.definitions import (
    BOOL,
    FLOATS,
    IMAGE,
    LASER_SCAN,
    ODOMETRY,
    POSE,
    STRING,
    TRANSFORMS,
    TWIST,
)
from palaestra_trainer.bags.writer import BagWriter
from palaestra_trainer.real_robots.safety import SafetyDecision, Situation
from palaestra_trainer.robots.base import SENSOR_RANGE_M

log = structlog.get_logger(__name__)

_MOST_WAITING: Final = 20_000  # the entries of more than a minute
_END_S: Final = 10.0
MOST_NUMBERS: Final = 4096
Floats = NDArray[np.float32]
Entry = tuple[str, str, Mapping[str, Any], float]


class DeploymentRecord:
    """Writes a bag in a thread of its own, as a context manager; before the context, entries are ignored.

    Args:
        path: the new file.
        about: names and values for the metadata of the bag.

    Attributes:
        dropped: the number of entries that were dropped because the disk was too slow.
    """

    def __init__(self, path: Path, about: Mapping[str, str]) -> None:
        self._path = path
        self._about = about
        self._bag: BagWriter | None = None
        self._waiting: queue.Queue[Entry | None] = queue.Queue(_MOST_WAITING)
        self._thread = threading.Thread(target=self._write, name="record", daemon=True)
        self._cause: str | None = None
        self.dropped = 0

    def __enter__(self) -> Self:
        """Create the file, and begin to write.

        Raises:
            ConfigurationError: the file exists.
            OSError: the file cannot be written.
        """
        self._bag = BagWriter(self._path, self._about)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Write the waiting entries, and close the file."""
        with suppress(queue.Full):  # the thread that writes has ended, or its disk hangs
            self._waiting.put(None, timeout=_END_S)
        self._thread.join(_END_S)
        if self.dropped:
            log.warning("the disk was too slow for the record", dropped_entries=self.dropped)

    def decided(self, situation: Situation, decision: SafetyDecision) -> None:
        """Record a decision of the command loop, with the odometry that it depended on."""
        now_s = time.time()
        self._put("/palaestra/cmd_vel", TWIST, messages.twist(decision.twist), now_s)
        if situation.pose is not None:
            pose = (situation.pose.x_m, situation.pose.y_m, situation.pose.heading_rad)
            odometry = messages.odometry(now_s, pose, situation.velocity)
            self._put("/odom", ODOMETRY, odometry, now_s)
            self._put("/tf", TRANSFORMS, messages.transform(now_s, pose), now_s)
        self._put("/bumper", BOOL, messages.bump(touched=situation.bumped), now_s)
        name = None if decision.cause is None else decision.cause.name
        if name != self._cause:
            self._cause = name
            self.note({"decision": "drive" if name is None else "stand", "cause": name})

    def step(self, distances_m: Floats, observation: Any, action: Any) -> None:
        """Record a step of the policy: the distances, the observation and the action.

        An observation with parts or more than `MOST_NUMBERS` numbers is left out; `image` records images.
        """
        now_s = time.time()
        scan = messages.ranges(now_s, distances_m.tolist(), SENSOR_RANGE_M)
        self._put("/distance_sensors", LASER_SCAN, scan, now_s)
        for topic, values in (("observation", observation), ("action", action)):
            if not isinstance(values, Mapping) and np.size(values) <= MOST_NUMBERS:
                numbers = messages.numbers(np.ravel(values).tolist(), topic)
                self._put(f"/palaestra/{topic}", FLOATS, numbers, now_s)

    def image(self, pixels: NDArray[np.uint8]) -> None:
        """Record the image that the policy saw."""
        now_s = time.time()
        self._put("/camera/image", IMAGE, messages.image(now_s, pixels), now_s)

    def target(self, x_m: float, y_m: float) -> None:
        """Record the target of an episode."""
        now_s = time.time()
        self._put("/target", POSE, messages.target(now_s, x_m, y_m), now_s)

    def note(self, facts: Mapping[str, object]) -> None:
        """Record facts as JSON."""
        self._put("/palaestra/decisions", STRING, messages.record(facts), time.time())

    def _put(self, topic: str, kind: str, content: Mapping[str, Any], stamp_s: float) -> None:
        if self._bag is None:
            return
        try:
            self._waiting.put_nowait((topic, kind, content, stamp_s))
        except queue.Full:
            self.dropped += 1

    def _write(self) -> None:
        try:
            with cast("BagWriter", self._bag) as bag:
                while (entry := self._waiting.get()) is not None:
                    bag.write(*entry)
        except OSError as error:
            log.error("the record ends here; the robot continues to drive", error=str(error))
