"""The real Robotino, which implements `RobotinoAbc` over a connection to the robot."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import CameraUnfit, NoReading, NoSuchSensor, RobotStopped, RobotUnfit
from palaestra_trainer.real_robots.camera import ImageSize
from palaestra_trainer.real_robots.command_loop import CommandLoop, Hooks
from palaestra_trainer.real_robots.frames import OdometryFrame, extrapolated
from palaestra_trainer.real_robots.link import RobotLink
from palaestra_trainer.real_robots.readings import Odometry, Readings, ReadingStore
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.safety import (
    BUMPER,
    SILENCE,
    STANDING,
    SafetyRules,
    is_finite,
    limited,
    stands,
)
from palaestra_trainer.robots.base import RobotinoAbc
from palaestra_trainer.robots.capabilities import Cameras
from palaestra_trainer.robots.geometry import Pose

IMAGE_SIZE: Final = (64, 48)  # width and height in pixels, as in the shipped worlds
_FIRST_READINGS_S: Final = 5.0
_STAND_S: Final = 3.0  # a Robotino brakes in a fraction of a second
_LOOK_S: Final = 0.01
_CHECK_S: Final = 0.05
_MOST_HELD_BACK_S: Final = 600.0


class RealRobotino(RobotinoAbc, Cameras):
    """A Robotino on a real floor.

    The pose comes from odometry, so it drifts. `advance` waits for the end of the period in real time. While
    the robot is held back, `advance` waits longer, and returns the number of extra periods that passed.
    Use the robot as a context manager: at its end, also after an exception, the robot gets the command to
    stand.

    Args:
        link: the connection to the robot.
        rules: the safety rules.
        period_s: seconds of one control period, as the policy learned with.
        clock: the robot's clock.
        hooks: functions that the robot calls.

    Attributes:
        rules: the safety rules.
        image_size: width and height of the color image; set it before `use_cameras`.
        commanded: the newest velocity of the policy, within the limits of the rules.
    """

    real = True

    def __init__(
        self,
        link: RobotLink,
        rules: SafetyRules | None = None,
        period_s: float = 0.192,
        clock: RobotClock | None = None,
        hooks: Hooks | None = None,
    ) -> None:
        self.rules = rules or SafetyRules()
        self._link = link
        self._period_s = period_s
        self._clock = clock or RobotClock()
        self._store = ReadingStore()
        called = hooks or Hooks()
        self._check = called.check
        self._loop = CommandLoop(link, self._store, self.rules, self._clock, called)
        self._seen = Readings()
        self._pose: Pose | None = None
        self._tick_s = 0.0
        self.image_size: ImageSize = IMAGE_SIZE
        self.commanded = STANDING

    @property
    def period_s(self) -> float:
        """Seconds of one control period."""
        return self._period_s

    def connect(self, *, muted: bool = False) -> None:
        """Check that the robot may be driven, and begin to send commands; the robot stands.

        Args:
            muted: send no command at all, for a dry run.

        Raises:
            RobotUnfit: the robot does not respond, charges, moves, or does not allow the speed of the rules.
        """
        self._link.refuse_unfit(self.rules.speed_m_s, self.rules.turn_rad_s)
        self._link.start(self._store)
        self._wait_for_readings()
        self._refuse_moving()
        self._loop.muted = muted
        self._loop.start()
        self.stand_at(Pose(0.0, 0.0, 0.0))

    def close(self) -> None:
        """Stop the robot and end the connection; further calls have no effect."""
        self._loop.close()
        self._link.close()

    def __enter__(self) -> Self:
        """Return the robot."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the robot and end the connection."""
        self.close()

    def unmute(self) -> None:
        """End a dry run: send commands from now on; the last command of the dry run is not sent."""
        self._loop.command(STANDING)
        self._loop.muted = False

    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the velocity until the next command: forward, left (m/s) and counter-clockwise (rad/s).

        Raises:
            RobotStopped: a velocity is not finite.
        """
        twist = (float(vx), float(vy), float(omega))  # a policy's numbers may be NumPy's
        if not is_finite(twist):
            self._loop.command(STANDING)
            raise RobotStopped(f"the policy commands {twist}; a velocity must be finite")
        self.commanded = limited(twist, self.rules)
        self._loop.command(twist)

    def advance(self) -> int:
        """Wait until the period is over and the robot is not held back; return the extra periods.

        Raises:
            RobotStopped: a safety rule has stopped the robot, but not after a bump, which `bumped` returns.
        """
        due_s = self._tick_s + self._period_s
        most_s = self._clock.now_s() + _MOST_HELD_BACK_S
        while (now_s := self._clock.now_s()) < due_s:
            self._wait(due_s - now_s)
        while (cause := self._loop.cause) is not None and not cause.stops and cause.name != SILENCE:
            if self._clock.now_s() > most_s:
                raise RobotStopped(f"held back for {_MOST_HELD_BACK_S:g} s: {cause.message}")
            self._wait(_LOOK_S)
        if cause is not None and cause.stops and cause.name != BUMPER:
            raise RobotStopped(f"{cause.name}: {cause.message}")
        now_s = self._clock.now_s()
        late = now_s > due_s + 0.5 * self._period_s
        extra = round((now_s - due_s) / self._period_s) if late else 0
        self._look(due_s + extra * self._period_s)
        return extra

    def stand(self) -> None:
        """Stop the robot, wait until it stands, and update all readings.

        Raises:
            RobotStopped: the robot still moves after some seconds.
        """
        self._loop.command(STANDING)
        begin_s = self._clock.now_s()
        while not self._stands_since(begin_s):
            if self._clock.now_s() > begin_s + _STAND_S:
                cause = self._loop.cause
                known = f"{cause.name}: {cause.message}; " if cause is not None and cause.stops else ""
                raise RobotStopped(f"{known}did not stop within {_STAND_S:g} s; use its emergency stop")
            self._wait(_LOOK_S)
        self._look(self._clock.now_s())

    def stand_at(self, start: Pose) -> None:
        """Begin an episode at the robot's current pose; a person has confirmed that this pose is `start`.

        Raises:
            RobotStopped: the robot does not stop.
        """
        self.stand()
        odometry = self._store.newest.odometry
        reported = start if odometry is None else odometry.pose
        self._loop.begin(OdometryFrame.through(reported, start), placed=True)
        self._look(self._clock.now_s())

    def begin(self, frame: OdometryFrame | None = None) -> None:
        """Begin an episode at the robot's current pose, as odometry reports it.

        Args:
            frame: the frame of the task; None: the frame stays.

        Raises:
            RobotStopped: the robot does not stop.
        """
        self.stand()
        self._loop.begin(frame)
        self._look(self._clock.now_s())

    def pose(self) -> Pose:
        """Return the pose by odometry, in the frame of the task."""
        if self._pose is None:
            raise NoReading("odometry has not arrived; call connect() first")
        return self._pose

    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, shape (9,), counter-clockwise from forward."""
        if self._seen.distances_m is None:
            raise NoReading("distances have not arrived; call connect() first")
        return self._seen.distances_m.copy()

    def bumped(self) -> bool:
        """Return whether the bumper touches something."""
        if self._seen.bumped is None:
            raise NoReading("the bumper's state has not arrived; call connect() first")
        return self._seen.bumped

    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Begin to receive images, and wait for the first one; call it after `connect`.

        From then on, an old image holds the robot back as any other old reading does.

        Raises:
            NoSuchSensor: a depth camera is chosen.
            CameraUnfit: no image of the size `image_size` has arrived in time.
        """
        if depth:
            raise NoSuchSensor(f"{self._link.address}: a Robotino has no depth camera")
        if not color:
            return
        self._link.use_camera(self._store, self.image_size)
        end_s = time.monotonic() + _FIRST_READINGS_S  # in real time, even if a mock robot is faster
        while self._store.newest.image is None:
            if time.monotonic() > end_s:
                raise CameraUnfit(f"{self._link.address}: {self._store.image_fault}")
            self._wait(_LOOK_S)
        self._look(self._clock.now_s())

    def color_image(self) -> NDArray[np.uint8]:
        """Return the newest image of the camera, shape (height, width, 3), RGB."""
        if self._seen.image is None:
            raise NoSuchSensor("the camera is not in use; call use_cameras(color=True) after connect()")
        return self._seen.image

    def depth_image(self) -> NDArray[np.float32]:
        """Refuse: a Robotino has no depth camera."""
        raise NoSuchSensor(f"{self._link.address}: a Robotino has no depth camera")

    def seen_image(self) -> NDArray[np.uint8] | None:
        """Return the newest image; None if no camera is in use."""
        return self._seen.image

    def _wait(self, robot_s: float) -> None:
        """Wait for some seconds of the robot's time, or less; the check of the hooks may raise."""
        self._check()
        self._loop.show_life()
        time.sleep(self._clock.real_s(min(robot_s, _CHECK_S)))

    def _look(self, at_s: float) -> None:
        """Take the newest readings; odometry is extrapolated to `at_s`, since it is up to 0.1 s old."""
        seen = self._store.newest
        cause = self._loop.cause
        if cause is not None and cause.name == BUMPER:
            seen = replace(seen, bumped=True)  # the bumper may have been released since it stopped the robot
        self._seen = seen
        self._tick_s = at_s
        if seen.odometry is not None:
            age_s = min(max(at_s - seen.odometry_s, 0.0), self.rules.stale_s)
            reported = extrapolated(seen.odometry.pose, seen.odometry.velocity, age_s)
            self._pose = self._loop.frame.of_task(reported)

    def _stands_since(self, begin_s: float) -> bool:
        """Return whether odometry that was measured after `begin_s` reports that the robot stands."""
        seen = self._store.newest
        return seen.odometry_s > begin_s and _stands(seen.odometry)

    def _wait_for_readings(self) -> None:
        end_s = self._clock.now_s() + _FIRST_READINGS_S
        while self._store.newest.oldest_s == -math.inf:
            if self._clock.now_s() > end_s:
                raise RobotUnfit(
                    f"{self._link.address}: sent no odometry, distances or bumper within "
                    f"{_FIRST_READINGS_S:g} s; check the address"
                )
            self._wait(_LOOK_S)

    def _refuse_moving(self) -> None:
        """Refuse a robot that moves before this program has sent a command."""
        end_s = self._clock.now_s() + 0.5
        while self._clock.now_s() < end_s:
            if not _stands(self._store.newest.odometry):
                raise RobotUnfit(
                    f"{self._link.address}: the robot moves; end the other client that drives it, and wait "
                    "until it stands"
                )
            self._wait(_LOOK_S)


def _stands(odometry: Odometry | None) -> bool:
    return odometry is None or stands(odometry.velocity)
