"""Services under `supervisor/`: they control the whole simulation, and return handles of nodes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_interfaces import Fields, Handler, Row, Service
from palaestra_sim.scene.geometry import Matrix, to_quaternion
from palaestra_sim.webots.library import Library
from palaestra_sim.webots.services.handles import WebotsHandles

_HEADSET: Final = "virtual_reality_headset"


def supervisor_services(library: Library, handles: WebotsHandles) -> tuple[Service, ...]:
    """Return the services of a supervisor, except those that take the handle of a node or a field."""
    rows = (*_simulation(library), *_recordings(library), *_headset(library), *_nodes(library, handles))
    return tuple(
        Service(f"supervisor/{name}", f"webots_ros/{type_name}", handler) for name, type_name, handler in rows
    )


def _ordered(action: Callable[[], Any]) -> Handler:
    """Return the handler of a command without arguments."""

    def handle(_request: Any) -> Fields:
        action()
        return {"value": True}

    return handle


def _told(action: Callable[[Any], Any]) -> Handler:
    """Return the handler of a command with a value."""

    def handle(request: Any) -> Fields:
        action(request.value)
        return {"success": True}

    return handle


def _simulation(library: Library) -> tuple[Row, ...]:
    def set_label(request: Any) -> Fields:
        library.supervisor_set_label(
            request.id,
            request.label,
            request.xpos,
            request.ypos,
            request.size,
            request.color,
            request.transparency,
            request.font,
        )
        return {"success": 1}

    reload = _ordered(library.supervisor_world_reload)
    return (
        ("simulation_quit", "set_int", _told(library.supervisor_simulation_quit)),
        ("simulation_reset", "get_bool", _ordered(library.supervisor_simulation_reset)),
        ("simulation_revert", "get_bool", reload),
        ("simulation_reset_physics", "get_bool", _ordered(library.supervisor_simulation_reset_physics)),
        (
            "simulation_get_mode",
            "get_int",
            lambda _: {"value": library.supervisor_simulation_get_mode()},
        ),
        ("simulation_set_mode", "set_int", _told(library.supervisor_simulation_set_mode)),
        ("world_load", "set_string", _told(library.supervisor_world_load)),
        (
            "world_save",
            "set_string",
            lambda request: {"success": library.supervisor_world_save(request.value)},
        ),
        ("world_reload", "get_bool", reload),
        ("set_label", "supervisor_set_label", set_label),
    )


def _recordings(library: Library) -> tuple[Row, ...]:
    def export_image(request: Any) -> Fields:
        library.supervisor_export_image(request.filename, request.quality)
        return {"success": 1}

    def start_movie(request: Any) -> Fields:
        library.supervisor_movie_start_recording(
            request.filename,
            request.width,
            request.height,
            request.codec,
            request.quality,
            request.acceleration,
            bool(request.caption),
        )
        return {"success": 1}

    start_animation = library.supervisor_animation_start_recording
    stop_animation = library.supervisor_animation_stop_recording
    return (
        ("export_image", "save_image", export_image),
        (
            "animation_start_recording",
            "set_string",
            lambda request: {"success": start_animation(request.value)},
        ),
        ("animation_stop_recording", "get_bool", lambda _: {"value": stop_animation()}),
        ("movie_start_recording", "supervisor_movie_start_recording", start_movie),
        ("movie_stop_recording", "get_bool", _ordered(library.supervisor_movie_stop_recording)),
        (
            "movie_failed",
            "node_get_status",
            lambda _: {"status": int(library.supervisor_movie_failed())},
        ),
        (
            "movie_is_ready",
            "node_get_status",
            lambda _: {"status": int(library.supervisor_movie_is_ready())},
        ),
    )


def _headset(library: Library) -> tuple[Row, ...]:
    used = library.supervisor_virtual_reality_headset_is_used

    def position(_request: Any) -> Fields:
        x, y, z = library.supervisor_virtual_reality_headset_get_position()
        return {"position": {"x": x, "y": y, "z": z}}

    def orientation(_request: Any) -> Fields:
        x, y, z, w = _quaternion(library.supervisor_virtual_reality_headset_get_orientation())
        return {"orientation": {"x": x, "y": y, "z": z, "w": w}}

    return (
        (f"{_HEADSET}_is_used", "get_bool", lambda _: {"value": used()}),
        (f"{_HEADSET}_get_position", f"supervisor_{_HEADSET}_get_position", position),
        (f"{_HEADSET}_get_orientation", f"supervisor_{_HEADSET}_get_orientation", orientation),
    )


def _quaternion(matrix: Matrix) -> tuple[float, ...]:
    """Return the quaternion of a rotation; NaN, which stands for no headset, stays NaN."""
    return (math.nan,) * 4 if math.isnan(matrix[0]) else to_quaternion(matrix)


def _nodes(library: Library, handles: WebotsHandles) -> tuple[Row, ...]:
    def from_def(request: Any) -> Fields:
        if not request.proto:
            return {"node": handles.of_node(library.supervisor_node_get_from_def(request.name))}
        proto = handles.node(request.proto)
        return {"node": handles.of_node(library.supervisor_node_get_from_proto_def(proto, request.name))}

    def from_device(request: Any) -> Fields:
        tag = library.robot_get_device(request.value)
        if not tag:
            raise ServiceFailed(
                f"the robot has no device {request.value!r}; get_device_list lists the devices"
            )
        return {"node": handles.of_node(library.supervisor_node_get_from_device(tag))}

    def found(get: Callable[[], int | None]) -> Handler:
        return lambda _request: {"value": handles.of_node(get())}

    return (
        ("get_root", "get_uint64", found(library.supervisor_node_get_root)),
        ("get_self", "get_uint64", found(library.supervisor_node_get_self)),
        ("get_selected", "get_uint64", found(library.supervisor_node_get_selected)),
        ("get_from_def", "supervisor_get_from_def", from_def),
        (
            "get_from_id",
            "supervisor_get_from_id",
            lambda request: {"node": handles.of_node(library.supervisor_node_get_from_id(request.id))},
        ),
        ("get_from_device", "supervisor_get_from_string", from_device),
    )
