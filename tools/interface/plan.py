"""The requests of the conformance program, and the expected responses.

A service without an entry in `REQUESTS` gets an empty request. The keys of `REQUESTS` are the ends of
services' paths. Every service must succeed. `ANSWERS` contains the responses that are known in advance, such
as a value that an earlier request has set.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from palaestra_trainer.ros.conformance.player import FILES
from tools.interface import training
from tools.interface.everything import (
    FAILING,
    NOT_IN_WEBOTS,
    ROBOT,
    UNCHECKED_IN_WEBOTS,
    offered,
    world,
)

Request = Mapping[str, Any]
Call = tuple[str, str, str, Request]  # name, path, type, request

STEP_MS = 32
QUIT_STATUS = 3
DRAWN = """DEF DRAWN Pose { children [ DEF SHADED Shape { castShadows FALSE
  appearance DEF PAINT PBRAppearance { roughness 0.25 baseColor 1 0.5 0.25 name "red" }
  geometry DEF ROUND Cylinder { subdivision 24 } } Shape { geometry DEF FLAT Plane { size 3 2 } } ] }"""
POINT = {"x": 2.5, "y": 1.0, "z": 0.5}
ENDING = (
    "simulation_reset",
    "restart_controller",
    "simulation_revert",
    "world_reload",
    "world_load",
    "simulation_quit",
)
FIELDS: Mapping[str, tuple[str, str, Any]] = {
    "bool": ("SHADED", "castShadows", 1),
    "int32": ("ROUND", "subdivision", 12),
    "float": ("PAINT", "roughness", 0.5),
    "vec2f": ("FLAT", "size", {"x": 1.0, "y": 4.0, "z": 0.0}),
    "vec3f": ("BOX", "translation", POINT),
    "rotation": ("BOX", "rotation", {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8}),
    "color": ("PAINT", "baseColor", {"r": 0.5, "g": 0.25, "b": 1.0, "a": 1.0}),
    "string": ("PAINT", "name", "blue"),
}
REQUESTS: Mapping[str, Request] = {
    "set_logger_level": {"logger": "ros", "level": "debug"},
    "/enable": {"value": STEP_MS},
    "_enable": {"value": STEP_MS},
    "/enable_point_cloud": {"value": True},
    "camera/recognition_enable": {"value": STEP_MS},
    "_motor/set_velocity": {"value": 0.5},
    "/emitter/send": {"data": "hello"},
    "led/set_led": {"value": 1},
    "speaker/set_engine": {"value": "pico"},
    "speaker/set_language": {"value": "de-DE"},
    "display/attach_camera": {"value": "camera"},
    "display/image_paste": {"ir": "@display/image_new"},
    "display/image_delete": {"ir": "@display/image_new"},
    "sf_tracking": {"field": "@FIELD vec3f"},
    "keyboard/press": {"value": 65},
    "keyboard/release": {"value": 65},
    "joystick/press": {"value": 1},
    "joystick/release": {"value": 1},
    "emitter/set_channel": {"value": 0},
    "vacuum_gripper/turn_on": {"value": True},
    "supervisor/simulation_set_mode": {"value": 2},
    "supervisor/simulation_quit": {"value": QUIT_STATUS},
    "supervisor/get_from_def": {"name": "BOX"},
    "supervisor/get_from_device": {"value": "gps"},
    "supervisor/get_from_id": {"id": 0},
    "supervisor/set_label": {"label": "here"},
    "node/get_field": {"node": "@BOX", "fieldName": "translation"},
    "node/get_pose": {"node": "@BOX", "from_node": "@supervisor/get_self"},
    # Webots' controller reads a null pointer if the second node of these requests is 0.
    "enable_pose_tracking": {"node": "@BOX", "sampling_period": STEP_MS, "from_node": "@supervisor/get_self"},
    "disable_pose_tracking": {"node": "@BOX", "from_node": "@supervisor/get_self"},
    "node/set_visibility": {"node": "@BOX", "from": "@VIEWPOINT", "visible": 1},
    "node/set_joint_position": {"node": "@LINEARMOTOR_JOINT", "position": 0.0, "index": 1},
    "node/save_state": {"node": "@BOX", "state_name": "there"},
    "node/load_state": {"node": "@BOX", "state_name": "there"},
    "node/remove": {"node": "@ADDED"},
    "node/restart_controller": {"node": "@supervisor/get_self"},
    "node/get_velocity": {"node": "@BOX"},
    "field/import_node_from_string": {"field": "@CHILDREN", "position": -1, "nodeString": "Group { }"},
    "field/remove_node": {"field": "@CHILDREN", "position": -1},
    "field/remove": {"field": "@INFO", "index": 0},
    "field/get_node": {"field": "@CHILDREN", "index": 1},
    "field/get_count": {"field": "@CHILDREN"},
    "display/image_new": {"width": 1, "height": 1, "format": 3, "data": [1, 2, 3]},
    "lidar/get_layer_point_cloud": {"layer": 0},
}
ANSWERS: Mapping[str, Request] = {
    "robot/get_model": {"value": ""},
    "robot/get_mode": {"value": 0},
    "robot/get_basic_time_step": {"value": 32.0},
    "robot/get_supervisor": {"value": True},
    "robot/get_synchronization": {"value": True},
    "robot/get_number_of_devices": {"value": 26},
    "robot/get_custom_data": {"value": "seven"},
    "robot/get_data": {"value": "eight"},
    "robot/wait_for_user_input_event": {"event": 0},
    "distance_sensor/get_type": {"value": 0},
    "distance_sensor/get_aperture": {"value": 1.5708},
    "distance_sensor/get_max_value": {"value": 1000.0},
    "distance_sensor/get_lookup_table": {"value": [0.0, 0.0, 0.0, 0.1, 1000.0, 0.0]},
    "distance_sensor/get_sampling_period": {"value": STEP_MS},
    "touch_sensor/get_type": {"value": 0},
    "position_sensor/get_type": {"value": 0},
    "position_sensor/get_motor_name": {"value": ""},
    "rotational_motor/get_type": {"value": 0},
    "rotational_motor/get_velocity": {"value": 0.5},
    "rotational_motor/get_max_velocity": {"value": 10.0},
    "rotational_motor/get_max_torque": {"value": 10.0},
    "linear_motor/get_type": {"value": 1},
    "linear_motor/get_node_type": {"value": 50},
    "brake/get_name": {"value": "brake"},
    "gps/get_coordinate_system": {"value": 0},
    "gps/get_node_type": {"value": 44},
    "compass/get_lookup_table": {"value": []},
    "inertial_unit/get_noise": {"value": 0.0},
    "led/get_led": {"value": 1},
    "camera/get_info": {"width": 64, "height": 64, "Fov": 0.7854, "nearRange": 0.01},
    "camera/has_recognition": {"value": True},
    "camera/recognition_is_segmentation_enabled": {"value": False},
    "range_finder/get_info": {"width": 64, "height": 64, "Fov": 0.7854, "minRange": 0.01, "maxRange": 1.0},
    "radar/get_max_range": {"value": 50.0},
    "lidar/get_info": {"horizontalResolution": 512, "numberOfLayers": 1, "minRange": 0.01, "maxRange": 1.0},
    "lidar/get_frequency_info": {"frequency": 10.0, "minFrequency": 1.0, "maxFrequency": 25.0},
    "emitter/get_channel": {"value": 0},
    "emitter/get_range": {"value": 0.0},
    "receiver/get_queue_length": {"value": 0},
    "receiver/get_data_size": {"value": -1},
    "receiver/get_emitter_direction": {"direction": [0.0, 0.0, 0.0]},
    "speaker/get_engine": {"value": "pico"},
    "speaker/is_speaking": {"value": False},
    "connector/is_locked": {"value": False},
    "vacuum_gripper/is_on": {"value": True},
    "display/get_info": {"width": 64, "height": 64},
    "display/image_load": {"ir": 1},  # the first image was deleted
    "skin/get_bone_count": {"value": 0},
    "joystick/get_number_of_axes": {"value": 6},
    "joystick/is_connected": {"value": True},
    "supervisor/simulation_get_mode": {"value": 2},
    "supervisor/get_selected": {"value": 0},
    "supervisor/movie_is_ready": {"status": 1},
    "supervisor/movie_stop_recording": {"value": True},
    "supervisor/virtual_reality_headset_is_used": {"value": False},
    "supervisor/node/get_type": {"type": 80},
    "supervisor/node/get_type_name": {"name": "Solid"},
    "supervisor/node/get_base_type_name": {"name": "Solid"},
    "supervisor/node/is_proto": {"value": False},
    "supervisor/node/get_def": {"name": "BOX"},
    # A node moves in the step after its field has changed.
    "supervisor/node/get_position": {"position": {"x": 2.0, "y": 0.0, "z": 0.5}},
    "supervisor/field/get_name": {"name": "roughness"},
    "supervisor/field/get_type": {"type": 3},
    "supervisor/field/get_type_name": {"name": "SFFloat"},
}


LATE = ("camera/recognition_enable_segmentation",)  # called last, because the service ends its topic

HANDLES = ("BOX", "VIEWPOINT", "LINEARMOTOR_JOINT", "SHADED", "PAINT", "ROUND", "FLAT")


def interface() -> dict[str, Any]:
    """Return the content of the conformance program's interface.json, which has the claims as data."""
    surveys = {simulator: offered(simulator) for simulator in FAILING}
    services = {path: it for survey in surveys.values() for path, it in survey.services.items()}
    topics = {path: it for survey in surveys.values() for path, it in survey.topics.items()}
    calls, last = _calls(services)
    known = services | topics
    absent = {
        simulator: sorted(known.keys() - survey.services.keys() - survey.topics.keys())
        for simulator, survey in surveys.items()
    }
    absent["webots"] = sorted(
        path for path in known if path.startswith("palaestra/") or path in NOT_IN_WEBOTS | UNCHECKED_IN_WEBOTS
    )
    fails = {simulator: sorted(paths) for simulator, paths in FAILING.items()}
    return {
        "robot": ROBOT,
        "step_ms": STEP_MS,
        "world": world(),
        "calls": calls,
        "topics": topics,
        "last": last,
        "expected": ANSWERS,
        "fails": {**fails, "webots": []},
        "absent": absent,
        "training": training.claims(),
    }


def _calls(typed: Mapping[str, str]) -> tuple[list[Call], list[Call]]:
    """Return the calls in their order, and those that end a controller or the simulator."""
    last: list[Call] = []
    calls = [_call(typed, name, path, request) for name, path, request in _opening()]
    named = {name for name, *_ in calls}
    for path in typed:
        if path.endswith(ENDING):
            last.append(_call(typed, path, path, _request(path)))
        elif path != "robot/time_step" and path not in named:
            calls.append(_call(typed, path, path, _request(path)))
    calls.sort(key=lambda call: call[0] in LATE)
    last.sort(key=lambda call: [call[0].endswith(end) for end in ENDING], reverse=True)
    return calls, last


def _call(typed: Mapping[str, str], name: str, path: str, request: Request) -> Call:
    return name, path, typed[path], request


def _opening() -> Iterator[tuple[str, str, Request]]:
    """Yield the first calls: for handles, and for one field of each type, which is written and read."""
    get_field, from_def = "supervisor/node/get_field", "supervisor/get_from_def"
    for name, text in (("data", "eight"), ("custom_data", "seven")):
        yield f"robot/set_{name}", f"robot/set_{name}", {"value": text}
        yield f"robot/get_{name}", f"robot/get_{name}", {}
    yield "another key", "palaestra/keyboard/press", {"value": 66}
    yield "another button", "palaestra/joystick/press", {"value": 2}
    yield "supervisor/get_root", "supervisor/get_root", {}
    yield "supervisor/get_self", "supervisor/get_self", {}
    yield "CHILDREN", get_field, {"node": "@supervisor/get_root", "fieldName": "children"}
    imported = "supervisor/field/import_node_from_string"
    yield imported, imported, {"field": "@CHILDREN", "position": -1, "nodeString": DRAWN}
    yield "GROUP", imported, {"field": "@CHILDREN", "position": -1, "nodeString": "DEF ADDED Group { }"}
    for name in (*HANDLES, "ADDED"):
        yield name, from_def, {"name": name}
    yield "WORLD", "supervisor/field/get_node", {"field": "@CHILDREN", "index": 0}
    yield "INFO", get_field, {"node": "@WORLD", "fieldName": "info"}
    for type_name, (node, field, value) in FIELDS.items():
        yield f"FIELD {type_name}", get_field, {"node": f"@{node}", "fieldName": field}
        for verb in ("set", "get", "insert"):
            path = f"supervisor/field/{verb}_{type_name}"
            given = {} if verb == "get" else {"value": value}
            yield path, path, {"field": f"@FIELD {type_name}", "index": 0, **given}


def _request(path: str) -> Request:
    found = _of_files(path)
    if found is not None:
        return found
    request = next((it for end, it in REQUESTS.items() if path.endswith(end)), {})
    if path.startswith("supervisor/node/") and "node" not in request:
        return {"node": "@BOX", **request}
    if path.startswith("supervisor/field/") and "field" not in request:
        return {"field": "@FIELD float", **request}
    return request


_NAMED_FILES: Mapping[str, Request] = {
    "supervisor/world_load": {"value": f"{FILES}/everything.wbt"},
    "supervisor/world_save": {"value": f"{FILES}/saved.wbt"},
    "supervisor/animation_start_recording": {"value": f"{FILES}/film.html"},
    "display/image_load": {"filename": f"{FILES}/logo.png"},
    "supervisor/movie_start_recording": {
        "filename": f"{FILES}/movie.mp4",
        "quality": 90,
        "acceleration": 1,
        "width": 64,
        "height": 48,
    },
}


def _of_files(path: str) -> Request | None:
    """Return the request to a service that reads or writes a file, or None for any other service."""
    if path.endswith(("/image_save", "/save_image", "/export_image", "_save_segmentation_image")):
        return {"filename": f"{FILES}/picture.png"}
    return _NAMED_FILES.get(path)
