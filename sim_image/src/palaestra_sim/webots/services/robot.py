"""The services under `robot/`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Handler, Row, Service
from palaestra_sim.webots.devices import names
from palaestra_sim.webots.library import Library

_DONE: Final = {"success": True}


def robot_services(library: Library) -> tuple[Service, ...]:
    """Return the services of every robot, except `time_step` and `get_device_list`."""
    return tuple(
        Service(f"robot/{name}", f"webots_ros/{type_name}", handler)
        for name, type_name, handler in (*_facts(library), *_actions(library))
    )


def device_list(library: Library) -> Service:
    """Return the service that lists the names of all devices."""
    found = names(library)
    return Service("robot/get_device_list", "webots_ros/robot_get_device_list", lambda _: {"list": found})


def _facts(library: Library) -> tuple[Row, ...]:
    facts: dict[str, tuple[str, Callable[[], Any]]] = {
        "get_model": ("get_string", library.robot_get_model),
        "get_mode": ("get_int", library.robot_get_mode),
        "get_supervisor": ("get_bool", library.robot_get_supervisor),
        "get_synchronization": ("get_bool", library.robot_get_synchronization),
        "get_project_path": ("get_string", library.robot_get_project_path),
        "get_world_path": ("get_string", library.robot_get_world_path),
        "get_basic_time_step": ("get_float", library.robot_get_basic_time_step),
        "get_number_of_devices": ("get_int", library.robot_get_number_of_devices),
        "get_time": ("get_float", library.robot_get_time),
        "get_custom_data": ("get_string", library.robot_get_custom_data),
        "get_data": ("get_string", library.robot_get_custom_data),
        "wwi_receive_text": ("get_string", library.robot_wwi_receive_text),
    }
    return tuple((name, type_name, _reading(read)) for name, (type_name, read) in facts.items())


def _reading(read: Callable[[], Any]) -> Handler:
    return lambda _request: {"value": read()}


def _actions(library: Library) -> tuple[Row, ...]:
    def wait(request: Any) -> Fields:
        """Wait for a key or a button; in this time no other service of this robot responds, as in Webots."""
        return {"event": library.robot_wait_for_user_input_event(request.eventType, request.timeout)}

    def set_custom_data(request: Any) -> Fields:
        library.robot_set_custom_data(request.value)
        return _DONE

    def set_mode(request: Any) -> Fields:
        library.robot_set_mode(request.mode, bytes(request.arg).decode(errors="replace"))
        return {"success": 1}

    def send_text(request: Any) -> Fields:
        text = request.value.encode() + b"\0"
        library.robot_wwi_send(text, len(text))
        return _DONE

    event = "wait_for_user_input_event"
    return (
        (event, f"robot_{event}", wait),
        ("get_urdf", "get_urdf", lambda request: {"value": library.robot_get_urdf(request.prefix)}),
        ("set_custom_data", "set_string", set_custom_data),
        ("set_data", "set_string", set_custom_data),
        ("set_mode", "robot_set_mode", set_mode),
        ("wwi_send_text", "set_string", send_text),
    )
