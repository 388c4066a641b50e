"""The robots of this package's simulators, as their controllers serve them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from palaestra_sim.ros_controller.handles import Handles
from palaestra_sim.ros_controller.host import Host
from palaestra_sim.ros_controller.inputs import inputs
from palaestra_sim.ros_controller.served_robot import ServedDevice, ServedRobot
from palaestra_sim.ros_controller.services.robot import RobotServices
from palaestra_sim.ros_controller.services.scene_fields import FieldServices
from palaestra_sim.ros_controller.services.scene_nodes import NodeServices
from palaestra_sim.ros_controller.services.supervisor import SupervisorServices
from palaestra_sim.ros_interfaces import Row, Service, topic_name
from palaestra_sim.scene.devices.device_type import ROLES, Device, DeviceType, Shaft
from palaestra_sim.scene.nodes.types import type_number
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.stepping import Stepping

_CAMERA: Final = "Camera"


def served(host: Host, stepping: Stepping, handles: Handles, robot: Robot) -> ServedRobot:
    """Return a robot of a scene with the services, devices and steps that its controller needs."""
    arguments = host.arguments(robot)
    services = RobotServices(host, handles.simulation, robot)
    return ServedRobot(
        basic_step_ms=handles.simulation.basic_step_ms,
        synchronized=robot.parts.node.flag("synchronization", True),
        clock=arguments.clock,
        auto_publish=arguments.auto_publish,
        world=handles.simulation,
        steps=_RobotSteps(stepping, robot),
        services=(*services.table(), *_supervisor_services(host, handles, robot)),
        devices=tuple(_devices(robot)),
        inputs=inputs(robot),
        device_list=services.device_list(),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _RobotSteps:
    """The steps of one robot of a scene."""

    stepping: Stepping
    robot: Robot

    def join(self) -> None:
        self.stepping.join(self.robot)

    def leave(self) -> None:
        self.stepping.leave(self.robot)

    def ask(self, duration_ms: int, done: Callable[[bool], None]) -> None:
        self.stepping.ask(self.robot, duration_ms, done)


def _supervisor_services(host: Host, handles: Handles, robot: Robot) -> tuple[Service, ...]:
    if not robot.parts.node.flag("supervisor", False):
        return ()
    return (
        *SupervisorServices(host, handles, robot).table(),
        *NodeServices(host, handles).table(),
        *FieldServices(handles).table(),
    )


def _devices(robot: Robot) -> Iterator[ServedDevice]:
    devices = robot.parts.devices
    for name, (kind, device) in devices.rows.items():
        yield ServedDevice(
            path=topic_name(name),
            topics=kind.topics(device),
            accepts=kind.accepts(device),
            enabled=partial(kind.enabled, device),
            prefix=kind.sensor and f"{kind.sensor}/",
            rows=_rows(kind, device, devices.shafts.get(name)),
            streams=kind.streams(device),
            camera=name if kind.node == _CAMERA else "",
        )


def _rows(kind: DeviceType[Any], device: Device, shaft: Shaft | None) -> tuple[Row, ...]:
    """Return the services of a device, without `enable` and `get_sampling_period`.

    `shaft` is the joint of the device, if it has one.
    """
    return (
        ("get_model", "get_string", lambda _: {"value": device.model}),
        ("get_name", "get_string", lambda _: {"value": device.name}),
        ("get_node_type", "get_int", lambda _: {"value": type_number(kind.node)}),
        *kind.services(device),
        *_neighbors(kind, shaft),
    )


def _neighbors(kind: DeviceType[Any], shaft: Shaft | None) -> tuple[Row, ...]:
    """Return the services that report the names of the other devices of a joint."""
    if shaft is None:
        return ()
    names = shaft.names
    return tuple(
        (f"get_{role}_name", "get_string", lambda _, role=role: {"value": names.get(role, "")})
        for role in ROLES
        if role != kind.role
    )
