"""A robot as its controller serves it: devices, services and steps.

The controller uses only this interface. `scene_robot` makes a `ServedRobot` from a robot of this package's
simulators, and `palaestra_sim.webots` makes a `ServedRobot` from a robot in Webots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from palaestra_sim.ros_interfaces import Row, Service
from palaestra_sim.scene.devices.device_type import DeviceTopic, Enable, Stream, whole_steps
from palaestra_sim.scene.mode import Mode


def _ignore_period(_period_ms: int) -> None:
    """Do nothing with a new sampling period."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ServedDevice:
    """A device with its services and topics.

    Attributes:
        path: the first part of the paths of the device's topics and services.
        topics: the topics that the service `enable` starts; without topics the device has no `enable`.
        accepts: returns whether `enable` accepts a sampling period.
        enabled: called after each change with the new sampling period in ms; 0 means off.
        prefix: a prefix of the paths `enable` and `get_sampling_period`, such as "torque_feedback_sensor/".
        rows: the other services; their paths are below `path`.
        own_rows: services that Webots does not have; their paths are below `palaestra/` and `path`.
        streams: topics with their own `enable`.
        camera: the name of a camera, whose first topic has pictures for viewers; "" for other devices.
    """

    path: str
    topics: tuple[DeviceTopic, ...] = ()
    accepts: Enable = whole_steps
    enabled: Callable[[int], None] = _ignore_period
    prefix: str = ""
    rows: tuple[Row, ...] = ()
    own_rows: tuple[Row, ...] = ()
    streams: tuple[Stream, ...] = ()
    camera: str = ""


class Steps(Protocol):
    """The steps of one robot; the world advances when each robot for which it waits has requested a step."""

    def join(self) -> None:
        """Let the world wait for this robot from now on."""
        ...

    def leave(self) -> None:
        """Stop waiting for this robot, and drop its request."""
        ...

    def ask(self, duration_ms: int, done: Callable[[bool], None]) -> None:
        """Request a step; later or at once, call `done` with True if the world has advanced, else False."""
        ...


class WorldTime(Protocol):
    """The time and mode of the world, which the controller reads after each step."""

    @property
    def time_ms(self) -> int:
        """The simulated time in milliseconds."""
        ...

    @property
    def mode(self) -> Mode:
        """The simulation mode; in REAL_TIME the controller delays its responses."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ServedRobot:
    """A robot with everything that its controller needs.

    Attributes:
        basic_step_ms: the basic time step in milliseconds.
        synchronized: whether the world waits for the steps of this robot.
        clock: whether to publish /clock.
        auto_publish: whether every device is enabled from the start.
        world: the time and mode of the world.
        steps: the steps of this robot.
        services: all services, except `time_step`, the services of devices and `device_list`.
        devices: the devices in the order of the world file.
        inputs: the devices that are not nodes of the world; `auto_publish` does not enable them.
        device_list: the last service to be advertised. A client that waits for it finds all other services.
    """

    basic_step_ms: int
    synchronized: bool
    clock: bool
    auto_publish: bool
    world: WorldTime
    steps: Steps
    services: tuple[Service, ...]
    devices: tuple[ServedDevice, ...]
    inputs: tuple[ServedDevice, ...]
    device_list: Service
