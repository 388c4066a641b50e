"""Services under `supervisor/`: they control the whole simulation, and return handles of nodes.

Images and movies are saved if the simulator can render. A request for an animation fails.
"""

from __future__ import annotations

from typing import Any, Final

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.handles import Handles
from palaestra_sim.ros_controller.host import Host
from palaestra_sim.ros_interfaces import Service
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.movies import Movie
from palaestra_sim.scene.robot import Robot

Fields = dict[str, Any]

_HEADSET: Final = "virtual_reality_headset"


class SupervisorServices:
    """The services of one supervisor that control the whole simulation, or return handles of nodes."""

    def __init__(self, host: Host, handles: Handles, robot: Robot) -> None:
        self._host = host
        self._simulation = handles.simulation
        self._tree = handles.tree
        self._handles = handles
        self._robot = robot

    def table(self) -> tuple[Service, ...]:
        """Return the services, with their paths relative to the robot."""
        return tuple(
            Service(f"supervisor/{name}", f"webots_ros/{type_name}", handler)
            for name, type_name, handler in (
                ("simulation_quit", "set_int", self._quit),
                ("simulation_reset", "get_bool", self._reset),
                ("simulation_revert", "get_bool", self._reload),
                ("simulation_reset_physics", "get_bool", self._reset_physics),
                ("simulation_get_mode", "get_int", self._get_mode),
                ("simulation_set_mode", "set_int", self._set_mode),
                ("world_load", "set_string", self._load),
                ("world_save", "set_string", _no_saving),
                ("world_reload", "get_bool", self._reload),
                ("export_image", "save_image", self._export),
                ("animation_start_recording", "set_string", _no_animation),
                ("animation_stop_recording", "get_bool", _refuse_get),
                ("movie_start_recording", "supervisor_movie_start_recording", self._start_movie),
                ("movie_stop_recording", "get_bool", self._stop_movie),
                ("movie_failed", "node_get_status", self._movie_failed),
                ("movie_is_ready", "node_get_status", self._movie_is_ready),
                ("set_label", "supervisor_set_label", _accept),
                (f"{_HEADSET}_is_used", "get_bool", _refuse_get),
                (f"{_HEADSET}_get_position", f"supervisor_{_HEADSET}_get_position", _no_headset),
                (f"{_HEADSET}_get_orientation", f"supervisor_{_HEADSET}_get_orientation", _no_headset),
                ("get_root", "get_uint64", self._get_root),
                ("get_self", "get_uint64", self._get_self),
                ("get_selected", "get_uint64", _nothing_selected),
                ("get_from_def", "supervisor_get_from_def", self._get_from_def),
                ("get_from_id", "supervisor_get_from_id", self._get_from_id),
                ("get_from_device", "supervisor_get_from_string", self._get_from_device),
            )
        )

    def _quit(self, request: Any) -> Fields:
        self._host.quit(request.value)
        return {"success": True}

    def _reset(self, _request: Any) -> Fields:
        self._simulation.reset()
        return {"value": True}

    def _reset_physics(self, _request: Any) -> Fields:
        self._simulation.reset_physics()
        return {"value": True}

    def _reload(self, _request: Any) -> Fields:
        self._host.reload()
        return {"value": True}

    def _load(self, request: Any) -> Fields:
        return {"success": self._host.load(request.value)}

    def _get_mode(self, _request: Any) -> Fields:
        return {"value": int(self._simulation.mode)}

    def _set_mode(self, request: Any) -> Fields:
        known = request.value in set(Mode)
        if known:
            self._host.set_mode(Mode(request.value))
        return {"success": known}

    def _export(self, request: Any) -> Fields:
        return {"success": int(self._simulation.export_image(request.filename, request.quality))}

    def _start_movie(self, request: Any) -> Fields:
        movie = Movie(
            path=request.filename,
            size=(request.width, request.height),
            quality=request.quality,
            acceleration=request.acceleration,
        )
        return {"success": int(self._simulation.movies.start(movie))}

    def _stop_movie(self, _request: Any) -> Fields:
        self._simulation.movies.stop()
        return {"value": True}

    def _movie_failed(self, _request: Any) -> Fields:
        return {"status": int(self._simulation.movies.failed)}

    def _movie_is_ready(self, _request: Any) -> Fields:
        return {"status": int(self._simulation.movies.ready)}

    def _get_root(self, _request: Any) -> Fields:
        return {"value": self._handles.of(self._tree.root)}

    def _get_self(self, _request: Any) -> Fields:
        return {"value": self._handles.of(self._robot.parts.node)}

    def _get_from_def(self, request: Any) -> Fields:
        """Return the handle of the node with a DEF name, in the world or inside an instance of a PROTO."""
        within = self._handles.node(request.proto) if request.proto else None
        if within is not None and not within.proto_name:
            return {"node": 0}
        return {"node": self._handles.of(self._tree.of_def(request.name, within))}

    def _get_from_id(self, request: Any) -> Fields:
        return {"node": self._handles.of(self._tree.of_number(request.id))}

    def _get_from_device(self, request: Any) -> Fields:
        node = self._robot.parts.devices.nodes.get(request.value)
        if node is None:
            raise ServiceFailed(
                f"the robot has no device {request.value!r}; get_device_list lists the devices"
            )
        return {"node": self._handles.of(node)}


def _accept(_request: Any) -> Fields:
    return {"success": 1}


def _no_saving(_request: Any) -> Fields:
    raise ServiceFailed("this simulator saves no worlds; use driver webots")


def _no_animation(_request: Any) -> Fields:
    raise ServiceFailed("this simulator records no animations; record a movie, or use driver webots")


def _refuse_get(_request: Any) -> Fields:
    return {"value": False}


def _no_headset(_request: Any) -> Fields:
    raise ServiceFailed("no virtual-reality headset is used; check virtual_reality_headset_is_used first")


def _nothing_selected(_request: Any) -> Fields:
    return {"value": 0}
