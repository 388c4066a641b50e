"""The result of each function of libController, from the services of a robot in this project's stub.

A function of a device has the name `<kind>_<verb>`. Most verbs are names of services, whose request has the
arguments in their order and whose response has one value. The tables below have the other verbs.
"""

import math
import os
import sys
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

from palaestra_protocol.ros import definitions
from palaestra_sim.errors import SimError
from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.scene.geometry import (
    axis_angle_to_quaternion,
    quaternion_to_matrix,
    to_axis_angle,
)
from tests.fake_webots.wire import RESULTS

KINDS = (
    *("accelerometer", "altimeter", "brake", "camera", "compass", "connector", "display"),
    *("distance_sensor", "emitter", "gps", "gyro", "inertial_unit", "led", "lidar", "light_sensor"),
    *("motor", "pen", "position_sensor", "radar", "range_finder", "receiver", "skin", "speaker"),
    *("touch_sensor", "vacuum_gripper"),
)
# The functions that return a part of a service's response.
PARTS = {
    "camera": {
        "get_info": {"get_width": "width", "get_height": "height", "get_fov": "Fov", "get_near": "nearRange"},
        "get_focus_info": {
            "get_focal_length": "focalLength",
            "get_focal_distance": "focalDistance",
            "get_max_focal_distance": "maxFocalDistance",
            "get_min_focal_distance": "minFocalDistance",
        },
        "get_zoom_info": {"get_min_fov": "minFov", "get_max_fov": "maxFov"},
    },
    "range_finder": {
        "get_info": {
            "get_width": "width",
            "get_height": "height",
            "get_fov": "Fov",
            "get_min_range": "minRange",
            "get_max_range": "maxRange",
        }
    },
    "lidar": {
        "get_info": {
            "get_horizontal_resolution": "horizontalResolution",
            "get_number_of_layers": "numberOfLayers",
            "get_fov": "fov",
            "get_vertical_fov": "verticalFov",
            "get_min_range": "minRange",
            "get_max_range": "maxRange",
        },
        "get_frequency_info": {
            "get_frequency": "frequency",
            "get_min_frequency": "minFrequency",
            "get_max_frequency": "maxFrequency",
        },
    },
    "display": {"get_info": {"get_width": "width", "get_height": "height"}},
}
PART_OF = {
    (kind, verb): (service, part)
    for kind, services in PARTS.items()
    for service, parts in services.items()
    for verb, part in parts.items()
}
# The service that a function calls, and the value that it sends to the service.
ORDERS = {
    ("connector", "lock"): ("lock", True),
    ("connector", "unlock"): ("lock", False),
    ("vacuum_gripper", "turn_on"): ("turn_on", True),
    ("vacuum_gripper", "turn_off"): ("turn_on", False),
    ("lidar", "enable_point_cloud"): ("enable_point_cloud", True),
    ("lidar", "disable_point_cloud"): ("enable_point_cloud", False),
}
RENAMED = {("led", "set"): "set_led", ("led", "get"): "get_led"}
# The index of the topic whose value a function returns; functions that are not listed return topic 0.
TOPICS = {("gps", "get_speed"): 1, ("gps", "get_speed_vector"): 2, ("radar", "get_number_of_targets"): 1}
VALUES = {
    *("get_value", "get_values", "get_quaternion", "get_presence", "get_torque_feedback"),
    *("get_force_feedback", "get_speed", "get_speed_vector", "get_number_of_targets"),
}
NEIGHBORS = {"get_brake": "brake", "get_motor": "motor", "get_position_sensor": "position_sensor"}


def request_of(type_name, values):
    """Return a request of a service; fields without a value are 0, "" or an empty list."""
    message = definitions.service(f"webots_ros/{type_name}")[0]
    names = [field.name for field in message.fields]
    blank = ["" if field.type == "string" else 0 for field in message.fields]
    given = [_shaped(field, value) for field, value in zip(message.fields, values, strict=False)]
    values = (*given, *blank[len(given) :])
    return Request(
        **{"from_" if name == "from" else name: it for name, it in zip(names, values, strict=True)}
    )


class Request(SimpleNamespace):
    """A request of a service, with its fields as attributes."""

    def _asdict(self):
        return vars(self)


class _Vector(NamedTuple):
    x: float
    y: float
    z: float


class _Quaternion(NamedTuple):
    x: float
    y: float
    z: float
    w: float


class _Color(NamedTuple):
    r: float
    g: float
    b: float
    a: float


class _Twist(NamedTuple):
    linear: _Vector
    angular: _Vector


def _shaped(field, value):
    name = field.type
    if isinstance(value, bytes) and name == "string":
        return value.decode()
    if not isinstance(value, list) or name.startswith(("int", "float", "char")):
        return value
    if name.endswith("Twist"):
        return _Twist(_Vector(*value[:3]), _Vector(*value[3:]))
    if name.endswith("Quaternion"):
        return _Quaternion(*axis_angle_to_quaternion(tuple(value)))
    if name.endswith("ColorRGBA"):
        return _Color(*value, 1.0)
    return _Vector(*value, *[0.0] * (3 - len(value)))


def flat(value):
    """Return the numbers of a nested value in their order."""
    if isinstance(value, dict):
        return list(chain.from_iterable(map(flat, value.values())))
    if isinstance(value, list | tuple):
        return list(chain.from_iterable(map(flat, value)))
    return [value]


class Answers:
    """The functions of libController for one robot.

    Args:
        robot: the robot in the scene.
        served: the robot with the services of the stub.
        window: the texts that the robot has sent to its window.
    """

    def __init__(self, robot, served):
        self.robot = robot
        self.names = list(robot.parts.devices.rows)
        self.served = served
        self.window = []
        self.devices = list(served.devices)
        self.rows = {row.path: (row.type_name.partition("/")[2], row.handler) for row in served.services}
        self.keys = []
        if os.environ.get("FAKE_WEBOTS_PRESSED"):
            self._press()
        self.animation = None

    def call(self, name, arguments):
        """Return the result of a function, or libController's value for an error if a service refuses."""
        try:
            return self._answer(name, arguments)
        except (ServiceFailed, SimError) as error:
            sys.stderr.write(f"Error: wb_{name}(): {error}\n")
            return _NOTHING.get(RESULTS[name], 0)

    def _press(self):
        """Hold the key A and a button of a joystick, as a person before the window of Webots may do."""
        for device in self.served.inputs[1:]:
            row = next(row for row in device.own_rows if row[0] == "press")
            row[2](request_of(row[1], [65 if device.path == "keyboard" else 1]))

    def begin_step(self):
        """Make the keys that are pressed readable once more."""
        self.keys = list(self.served.inputs[1].topics[0].source.value)

    def _answer(self, name, arguments):
        own = getattr(self, f"_{name}", None)
        if own is not None:
            return own(*arguments)
        for kind in sorted(KINDS, key=len, reverse=True):
            if name.startswith(f"{kind}_"):
                return self._of_device(kind, name.removeprefix(f"{kind}_"), *arguments)
        group, _, verb = name.partition("_")
        if group == "supervisor":
            return self._of_supervisor(verb, arguments)
        if group == "joystick":
            return self._row(self.served.inputs[2].rows, verb, arguments)
        return self._service(f"robot/{verb}", arguments)

    def _service(self, path, arguments):
        type_name, handler = self.rows[path]
        response = handler(request_of(type_name, arguments))
        return next(iter(response.values()))

    def _row(self, rows, verb, arguments):
        type_name, handler = next((row[1], row[2]) for row in rows if row[0] == verb)
        return next(iter(handler(request_of(type_name, arguments)).values()))

    def _robot_get_name(self):
        return self.robot.name

    def _robot_get_device_by_index(self, index):
        return index + 1

    def _robot_get_device(self, name):
        return self.names.index(name.decode()) + 1 if name.decode() in self.names else 0

    def _robot_get_urdf(self, prefix):
        return f'<?xml version="1.0"?><robot name="{prefix.decode()}{self.robot.name}"/>'

    def _robot_battery_sensor_enable(self, period):
        pass

    def _robot_battery_sensor_disable(self):
        pass

    def _robot_battery_sensor_get_value(self):
        return self.served.inputs[0].topics[0].source.value

    def _robot_wwi_send(self, text):
        self.window.append(text)

    def _keyboard_enable(self, period):
        pass

    def _keyboard_disable(self):
        pass

    def _keyboard_get_key(self):
        return self.keys.pop(0) if self.keys else -1

    def _joystick_enable(self, period):
        pass

    def _joystick_disable(self):
        pass

    def _joystick_get_pressed_button(self):
        return self.served.inputs[2].topics[0].source.value

    def _joystick_get_axis_value(self, index):
        return self.served.inputs[2].topics[1 + index].source.value[0]

    def _joystick_get_pov_value(self, index):
        return self.served.inputs[2].topics[7 + index].source.value[0]

    def _device_get_name(self, tag):
        return self.names[tag - 1]

    def _device_get_model(self, tag):
        return self._row(self.devices[tag - 1].rows, "get_model", [])

    def _device_get_node_type(self, tag):
        return self._row(self.devices[tag - 1].rows, "get_node_type", [])

    def _gps_convert_to_degrees_minutes_seconds(self, angle):
        tag = next(tag for tag, it in enumerate(self.devices, 1) if it.topics and "gps" in it.path)
        verb = "decimal_degrees_to_degrees_minutes_seconds"
        return self._row(self.devices[tag - 1].rows, verb, [angle])

    def _supervisor_world_save(self, file):
        Path(file.decode()).write_text(self._service("supervisor/node/export_string", [self._root()]))
        return file.endswith(b".wbt")

    def _root(self):
        return self._service("supervisor/get_root", [])

    def _supervisor_animation_start_recording(self, file):
        self.animation = Path(file.decode())
        return file.endswith(b".html")

    def _supervisor_animation_stop_recording(self):
        self.animation.write_text("<html></html>")
        return True

    def _speaker_play_sound(self, left, right, *rest):
        assert left == right
        return self._row(self.devices[left - 1].rows, "play_sound", rest)

    def _display_image_save(self, display, image, file):
        return self._row(self.devices[display - 1].rows, "image_save", [file, image])

    def _display_attach_camera(self, display, camera):
        name = self.names[camera - 1].encode()
        return self._row(self.devices[display - 1].rows, "attach_camera", [name])

    def _emitter_send(self, tag, packet):
        return self._row(self.devices[tag - 1].rows, "send", [packet])

    def _receiver_get_data(self, tag):
        return self.devices[tag - 1].topics[0].source.value.encode()

    def _touch_sensor_get_value(self, tag):
        return float(self.devices[tag - 1].topics[0].source.value)

    def _touch_sensor_get_values(self, tag):
        return flat(self.devices[tag - 1].topics[0].source.value["force"])

    def _camera_get_image(self, tag):
        return self.devices[tag - 1].topics[0].source.value or None

    def _camera_recognition_get_number_of_objects(self, tag):
        return len(self._recognized(tag))

    def _camera_recognition_get_objects(self, tag):
        return [
            (
                number,
                it["position"],
                to_axis_angle(quaternion_to_matrix(it["orientation"])),
                (0.0, 0.0),
                [*map(int, it["position_on_image"][:2]), *map(int, it["size_on_image"][:2])],
                flat(it["colors"]),
                it["model"],
            )
            for number, it in enumerate(self._recognized(tag))
        ]

    def _recognized(self, tag):
        return self.devices[tag - 1].streams[0].topics[0].source.value

    def _camera_recognition_enable(self, tag, period):
        self.devices[tag - 1].streams[0].enabled(period)

    def _camera_recognition_disable(self, tag):
        self.devices[tag - 1].streams[0].enabled(0)

    def _camera_recognition_get_segmentation_image(self, tag):
        [*images] = self.devices[tag - 1].streams[0].topics[1].source.value
        return images[0] if images and images[0] else None

    def _range_finder_get_range_image(self, tag):
        data = bytes(self.devices[tag - 1].topics[0].source.value)
        return list(memoryview(data).cast("f")) or None

    def _lidar_get_range_image(self, tag):
        return list(memoryview(self.devices[tag - 1].topics[0].source.value).cast("f")) or None

    def _lidar_get_layer_range_image(self, tag, layer):
        image = self._row(self.devices[tag - 1].rows, "get_layer_range_image", [layer])
        return list(memoryview(image["data"]).cast("f")) or None

    def _lidar_get_point_cloud(self, tag):
        layers = self._of_device("lidar", "get_number_of_layers", tag)
        return [point for layer in range(layers) for point in self._lidar_get_layer_point_cloud(tag, layer)]

    def _lidar_get_layer_point_cloud(self, tag, layer):
        cloud = self._row(self.devices[tag - 1].rows, "get_layer_point_cloud", [layer])
        return [(it["x"], it["y"], it["z"], layer, 0.0) for it in cloud["points"]]

    def _lidar_get_number_of_points(self, tag):
        return len(self._lidar_get_point_cloud(tag))

    def _radar_get_targets(self, tag):
        return [flat(it) for it in self.devices[tag - 1].topics[0].source.value]

    def _of_device(self, kind, verb, tag, *arguments):
        device = self.devices[tag - 1]
        if (kind, verb) in PART_OF:
            service, part = PART_OF[kind, verb]
            return next(row[2] for row in device.rows if row[0] == service)(None)[part]
        if verb.startswith("get_lookup_table"):
            table = self._row(device.rows, "get_lookup_table", [])
            return table or None if verb == "get_lookup_table" else len(table) // 3
        if verb in NEIGHBORS:
            return self._robot_get_device(self._row(device.rows, f"{verb}_name", []).encode())
        if (kind, verb) in ORDERS:
            verb, *arguments = ORDERS[kind, verb]
        elif verb.startswith(("enable", "disable")):
            return device.enabled(arguments[0] if arguments else 0)
        if verb in VALUES:
            return self._measured(device.topics[TOPICS.get((kind, verb), 0)].source.value)
        return self._row(device.rows, RENAMED.get((kind, verb), verb), arguments)

    @staticmethod
    def _measured(value):
        if isinstance(value, dict) and "latitude" in value:
            return [value[name] for name in ("latitude", "longitude", "altitude")]
        return flat(value) if isinstance(value, dict | list | tuple) else value

    def _of_supervisor(self, verb, arguments):
        if verb.startswith("field_"):
            return self._of_field(verb.removeprefix("field_"), *arguments)
        if not verb.startswith("node_"):
            return self._service(f"supervisor/{verb}", arguments)
        verb = verb.removeprefix("node_")
        if verb in {"get_root", "get_self", "get_selected", "get_from_def", "get_from_id"}:
            return self._service(f"supervisor/{verb}", arguments)
        value = self._service(f"supervisor/node/{verb}", arguments)
        return flat(value) if isinstance(value, dict) else value

    def _supervisor_virtual_reality_headset_get_position(self):
        return [math.nan] * 3

    def _supervisor_virtual_reality_headset_get_orientation(self):
        return [math.nan] * 9

    def _supervisor_node_get_from_device(self, tag):
        return self._service("supervisor/get_from_device", [self.names[tag - 1].encode()])

    def _supervisor_node_get_from_proto_def(self, node, name):
        return self._service("supervisor/get_from_def", [name, node])

    def _supervisor_node_get_base_node_field(self, node, name):
        return self._service("supervisor/node/get_field", [node, name, True])

    def _supervisor_node_get_base_node_field_by_index(self, node, index):
        return self._service("supervisor/node/get_field_by_index", [node, index, True])

    def _supervisor_node_get_number_of_base_node_fields(self, node):
        return self._service("supervisor/node/get_number_of_fields", [node, True])

    _supervisor_node_get_proto_field = _supervisor_node_get_base_node_field
    _supervisor_node_get_proto_field_by_index = _supervisor_node_get_base_node_field_by_index
    _supervisor_node_get_proto_number_of_fields = _supervisor_node_get_number_of_base_node_fields

    def _supervisor_node_get_orientation(self, node):
        turn = self._service("supervisor/node/get_orientation", [node])
        return list(quaternion_to_matrix(tuple(turn[axis] for axis in "xyzw")))

    def _supervisor_node_get_pose(self, node, reference):
        pose = self._service("supervisor/node/get_pose", [reference, node])
        matrix = quaternion_to_matrix(tuple(pose["rotation"][axis] for axis in "xyzw"))
        place = [pose["translation"][axis] for axis in "xyz"]
        rows = [[*matrix[3 * i : 3 * i + 3], place[i]] for i in range(3)]
        return [*chain.from_iterable(rows), 0.0, 0.0, 0.0, 1.0]

    def _supervisor_node_get_contact_points(self, node, descendants):
        found = self._service("supervisor/node/get_contact_points", [node, descendants])
        return [(*flat(it["point"]), it["node_id"], 0) for it in found]

    def _of_field(self, verb, field, *arguments):
        action, _, rest = verb.partition("_")
        many, _, type_name = rest.partition("_")
        if action == "import":
            position, text = arguments if many == "mf" else (0, *arguments)
            return self._service("supervisor/field/import_node_from_string", [field, position, text])
        if action == "remove":
            return self._service("supervisor/field/remove", [field, *arguments])
        if many not in {"sf", "mf"} or action not in {"get", "set", "insert"}:
            return self._service(f"supervisor/field/{verb}", [field, *arguments])
        index, *value = arguments if many == "mf" else (0, *arguments)
        path = f"supervisor/field/{action}_{type_name}"
        return _value_of(type_name, self._service(path, [field, index, *value]))


def _value_of(type_name, value):
    """Return the value of a field as libController returns it."""
    if not isinstance(value, dict):
        return value
    numbers = flat(value)
    if type_name == "rotation":
        return list(to_axis_angle(quaternion_to_matrix(tuple(numbers))))
    return numbers[: 2 if type_name == "vec2f" else 3]


_NOTHING = {"doubles": None, "floats": None, "text": "", "bytes": None, "points": None, "targets": None}
_NOTHING |= {"objects": [], "contacts": None, "ref": 0, "none": None}
