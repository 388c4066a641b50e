"""The services under `robot/`, and services under `palaestra/` that Webots does not have."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator
from typing import Any, Final

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.backend import Backend
from palaestra_sim.ros_controller.host import Host
from palaestra_sim.ros_interfaces import Handler, Row, Service
from palaestra_sim.scene.robot import Robot

Fields = dict[str, Any]

_MOST_TEXTS: Final = 100  # maximum number of texts from the robot's window that wait to be read


class RobotServices:
    """The services of one robot, except `time_step` and the services of devices."""

    def __init__(self, host: Host, simulation: Backend, robot: Robot) -> None:
        self._host = host
        self._simulation = simulation
        self._robot = robot
        self._from_window: deque[str] = deque()

    def table(self) -> tuple[Service, ...]:
        """Return the services, with their paths relative to the robot."""
        own = (
            Service("palaestra/window/send_text", "webots_ros/set_string", self._send_as_window),
            Service("palaestra/scene", "webots_ros/get_string", self._get_scene),
            Service("palaestra/scene_state", "webots_ros/get_string", self._get_scene_state),
        )
        rows = (*self._constants(), *self._actions())
        return (*(Service(f"robot/{name}", f"webots_ros/{type_}", it) for name, type_, it in rows), *own)

    def _constants(self) -> Iterator[Row]:
        node = self._robot.parts.node
        world_path = self._host.world_path
        for name, type_name, value in (
            ("get_model", "get_string", node.text("model") or ""),
            ("get_mode", "get_int", 0),
            ("get_supervisor", "get_bool", node.flag("supervisor", False)),
            ("get_synchronization", "get_bool", node.flag("synchronization", True)),
            ("get_project_path", "get_string", str(world_path.parent.parent)),
            ("get_world_path", "get_string", str(world_path)),
            ("get_basic_time_step", "get_float", float(self._simulation.basic_step_ms)),
            ("get_number_of_devices", "get_int", len(self._robot.parts.devices.names)),
        ):
            yield name, type_name, _always({"value": value})

    def _actions(self) -> tuple[Row, ...]:
        wait = "wait_for_user_input_event"
        return (
            (wait, f"robot_{wait}", _always({"event": 0})),
            ("get_time", "get_float", lambda _: {"value": self._simulation.time_ms / 1000.0}),
            ("get_urdf", "get_urdf", _no_urdf),
            ("get_custom_data", "get_string", self._get_custom_data),
            ("set_custom_data", "set_string", self._set_custom_data),
            ("get_data", "get_string", self._get_custom_data),
            ("set_data", "set_string", self._set_custom_data),
            ("set_mode", "robot_set_mode", lambda request: {"success": int(request.mode == 0)}),
            ("wwi_send_text", "set_string", _always({"success": True})),
            ("wwi_receive_text", "get_string", self._receive_from_window),
        )

    def device_list(self) -> Service:
        """Return `get_device_list`, which is advertised last.

        A client that waits for this service then finds all other services.
        """
        names = list(self._robot.parts.devices.names)
        return Service("robot/get_device_list", "webots_ros/robot_get_device_list", lambda _: {"list": names})

    def _receive_from_window(self, _request: Any) -> Fields:
        return {"value": self._from_window.popleft() if self._from_window else ""}

    def _send_as_window(self, request: Any) -> Fields:
        """Queue a text for the controller, as if the robot's window in Webots had sent it."""
        if len(self._from_window) == _MOST_TEXTS:
            return {"success": False}
        self._from_window.append(request.value)
        return {"success": True}

    def _get_scene(self, _request: Any) -> Fields:
        scene = self._simulation.appearance.scene(self._host.world_path.name)
        return {"value": json.dumps(scene.to_json())}

    def _get_scene_state(self, _request: Any) -> Fields:
        state = self._simulation.appearance.state(self._simulation.time_ms)
        return {"value": json.dumps(state.to_json())}

    def _get_custom_data(self, _request: Any) -> Fields:
        return {"value": self._robot.custom_data}

    def _set_custom_data(self, request: Any) -> Fields:
        self._robot.custom_data = request.value
        return {"success": True}


def _always(fields: Fields) -> Handler:
    return lambda _request: fields


def _no_urdf(_request: Any) -> Fields:
    raise ServiceFailed("this simulator writes no URDF; use driver webots")
