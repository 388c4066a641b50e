"""Read the state of a simulation without changing it."""

from __future__ import annotations

import enum
import math
from typing import Any, Final, NamedTuple, TypeVar

from palaestra_protocol.fields import ProtocolError, decoded
from palaestra_protocol.scene import MOST_SCENE_BYTES, MOST_STATE_BYTES, SceneState, VisibleScene
from palaestra_trainer.errors import WrongData
from palaestra_trainer.ros import RosService, is_served
from palaestra_trainer.webots.obstacles import ObstacleReader, Thing
from palaestra_trainer.webots.services import Services
from palaestra_trainer.webots.world_node import Quaternion, Vector, WorldNode

_Data = TypeVar("_Data", VisibleScene, SceneState)

_SCENE: Final = "palaestra/scene"
_SCENE_STATE: Final = "palaestra/scene_state"
_HEADSET: Final = "supervisor/virtual_reality_headset"
_HEADSET_TYPE: Final = "supervisor_virtual_reality_headset"


class Mode(enum.IntEnum):
    """The modes of simulated time, with the numbers of Webots R2021a and later."""

    PAUSE = 0
    REAL_TIME = 1
    FAST = 2


class NodeName(NamedTuple):
    """The name of a node.

    Attributes:
        definition: the DEF name; "" for a node without a DEF name.
        type_name: the type, or the name of the PROTO.
    """

    definition: str
    type_name: str


class Observer:
    """Queries to the supervisor's controller, which do not affect the simulation.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.

    Args:
        node_name: the ROS name of the supervisor.
    """

    def __init__(self, node_name: str) -> None:
        self.node_name = node_name
        self._services = Services(node_name)
        self._nodes: dict[str, int] = {}
        self._fields: dict[tuple[str, str], int] = {}
        self._types: dict[tuple[str, str], int] = {}
        self._position = self._services.get("supervisor/node/get_position", "node_get_position")
        self._orientation = self._services.get("supervisor/node/get_orientation", "node_get_orientation")
        self._pose_requests: dict[str, tuple[bytes, bytes]] = {}
        self._surroundings = ObstacleReader(self._services)

    def time(self) -> float:
        """Return the simulated time in seconds."""
        return float(self._services.ask("robot/get_time", "get_float"))

    def basic_time_step_ms(self) -> int:
        """Return the length of one physics step in milliseconds."""
        return int(self._services.ask("robot/get_basic_time_step", "get_float"))

    def mode(self) -> Mode:
        """Return the mode in which time passes."""
        return Mode(self._services.ask("supervisor/simulation_get_mode", "get_int"))

    def world_path(self) -> str:
        """Return the path of the loaded world."""
        return str(self._services.ask("robot/get_world_path", "get_string"))

    def devices(self) -> tuple[str, ...]:
        """Return the names of the robot's devices."""
        return tuple(self._services.get("robot/get_device_list", "robot_get_device_list")(ask=1).list)

    def number_of_devices(self) -> int:
        """Return the number of the robot's devices."""
        return int(self._services.ask("robot/get_number_of_devices", "get_int"))

    def exists(self, name: str) -> bool:
        """Return whether the world has a node with DEF `name`."""
        return bool(self._services.get("supervisor/get_from_def", "supervisor_get_from_def")(name=name).node)

    def pose(self, name: str) -> tuple[float, float, float]:
        """Return the pose of the node with DEF `name`: x and y in meters, and the heading in radians."""
        self.begin_pose(name)
        return self.finish_pose(name)

    def begin_pose(self, name: str) -> RosService:
        """Request the pose of a node, and return the service that responds last.

        Call `finish_pose` afterwards; other work may be done in between.
        """
        position, orientation = self._pose_requests.get(name) or self._packed_pose_requests(name)
        self._position.send(position)
        self._orientation.send(orientation)
        return self._orientation

    def finish_pose(self, name: str) -> tuple[float, float, float]:
        """Return the pose that `begin_pose` requested."""
        place, turn = self._position.finish().position, self._orientation.finish().orientation
        x_m, y_m = place.x, place.y
        heading_rad = math.remainder(2.0 * math.atan2(turn.z, turn.w), 2.0 * math.pi)
        if not (math.isfinite(x_m) and math.isfinite(y_m) and math.isfinite(heading_rad)):
            self._services.require_finite(f"the pose of {name}", x_m, y_m, heading_rad)
        return x_m, y_m, heading_rad

    def full_pose(self, name: str) -> tuple[Vector, Quaternion]:
        """Return position and rotation, in the world, of the node with DEF `name`.

        The position is x, y, z in meters. The rotation is a quaternion: x, y, z, w.
        """
        return self.find(name).pose()

    def contact_points(self, name: str) -> tuple[Vector, ...]:
        """Return the points at which the node with DEF `name`, or a part of it, touches other objects.

        The points are x, y, z in meters, in the world. The stub and MuJoCo report no points on a floor. The
        stub reports only the points of robots.
        """
        return self.find(name).contact_points()

    def type_name(self, name: str) -> str:
        """Return the type of the node with DEF `name`, such as Solid, or the name of its PROTO."""
        return self.find(name).type_name

    def text(self, name: str) -> str:
        """Return the node with DEF `name` as text of a world file, with its current fields."""
        return self.find(name).text()

    def device_pose(self, device: str) -> tuple[Vector, Quaternion]:
        """Return position and rotation, in the world, of a device of the supervisor; see `full_pose`.

        Raises:
            WrongData: also if the supervisor's robot has no such device.
        """
        return self.find_device(device).pose()

    def center_of_mass(self, name: str) -> Vector:
        """Return the center of mass, in meters in the world, of the Solid with DEF `name` and its parts."""
        service = self._services.get("supervisor/node/get_center_of_mass", "node_get_center_of_mass")
        center = service(node=self.node(name)).centerOfMass
        self._services.require_finite(f"the center of mass of {name}", center.x, center.y, center.z)
        return center.x, center.y, center.z

    def is_balanced(self, name: str) -> bool:
        """Return whether the center of mass of the Solid with DEF `name` is above its support polygon."""
        service = self._services.get("supervisor/node/get_static_balance", "node_get_static_balance")
        return bool(service(node=self.node(name)).balance)

    def length(self, name: str, field: str) -> int:
        """Return the number of values in a field of the node with DEF `name`; -1 if it has only one value."""
        service = self._services.get("supervisor/field/get_count", "field_get_count")
        return int(service(field=self.field(name, field)).count)

    def nodes_in(self, name: str, field: str) -> tuple[NodeName, ...]:
        """Return the nodes in a field of the node with DEF `name`, such as its children.

        Raises:
            WrongData: also if the field does not hold nodes.
        """
        found = self.find(name).nodes(field)
        return tuple(NodeName(node.definition, node.type_name) for node in found)

    def find(self, name: str) -> WorldNode:
        """Return the node with DEF `name`; "" stands for the node that contains the whole world."""
        return WorldNode(self._services, self.node(name))

    def find_device(self, device: str) -> WorldNode:
        """Return the node of a device of the supervisor's robot.

        Raises:
            WrongData: also if the robot has no such device.
        """
        service = self._services.get("supervisor/get_from_device", "supervisor_get_from_string")
        return self._found(service(value=device).node, f"the robot has no device {device}")

    def with_id(self, number: int) -> WorldNode:
        """Return the node with this `id`.

        Raises:
            WrongData: also if no node has this `id`.
        """
        service = self._services.get("supervisor/get_from_id", "supervisor_get_from_id")
        return self._found(service(id=number).node, f"no node has the id {number}")

    def own_node(self) -> WorldNode:
        """Return the node of the supervisor's robot."""
        return self._found(self._services.ask("supervisor/get_self", "get_uint64"), "the robot has no node")

    def selected(self) -> WorldNode | None:
        """Return the node that is selected in the window of Webots; None if no node is selected."""
        handle = self._services.ask("supervisor/get_selected", "get_uint64")
        return WorldNode(self._services, int(handle)) if handle else None

    def headset_pose(self) -> tuple[Vector, Quaternion] | None:
        """Return the pose, in the world, of a virtual-reality headset; None if no headset is used."""
        if not self._services.ask(f"{_HEADSET}_is_used", "get_bool"):
            return None
        at, turn = (
            getattr(self._services.get(f"{_HEADSET}_get_{it}", f"{_HEADSET_TYPE}_get_{it}")(ask=True), it)
            for it in ("position", "orientation")
        )
        numbers = at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w
        self._services.require_finite("the pose of the headset", *numbers)
        return numbers[:3], numbers[3:]

    def translation(self, name: str) -> tuple[float, float, float]:
        """Return the translation field, in meters, of the node with DEF `name`."""
        field = self.field(name, "translation")
        value = self._services.get("supervisor/field/get_vec3f", "field_get_vec3f")(field=field).value
        return (value.x, value.y, value.z)

    def things(self) -> list[Thing]:
        """Return the objects in the world at their current positions; the floor has the name `FLOOR`.

        Raises:
            WorldMisfit: the world has no floor.
        """
        return self._surroundings.read()

    def scene(self) -> VisibleScene | None:
        """Return the visible objects of the world; None: the simulator, such as Webots, cannot list them."""
        if not is_served(f"/{self.node_name}/{_SCENE}"):
            return None
        return self._read(VisibleScene, _SCENE, MOST_SCENE_BYTES)

    def scene_state(self) -> SceneState:
        """Return the poses after the last step, for a scene that `scene` returned before."""
        return self._read(SceneState, _SCENE_STATE, MOST_STATE_BYTES)

    def node(self, name: str) -> int:
        """Return the handle of the node with DEF `name`, which is valid until the world is reloaded.

        The name "" stands for the node that contains the whole world.

        Raises:
            WrongData: the world has no such node.
        """
        if not name and name not in self._nodes:
            self._nodes[name] = int(self._services.ask("supervisor/get_root", "get_uint64"))
        if name not in self._nodes:
            answer = self._services.get("supervisor/get_from_def", "supervisor_get_from_def")(name=name)
            self._nodes[name] = self._known(answer.node, f"the world has no node DEF {name}")
        return self._nodes[name]

    def field(self, name: str, field: str) -> int:
        """Return the handle of a field of the node with DEF `name`.

        Raises:
            WrongData: the node has no such field.
        """
        if (name, field) not in self._fields:
            service = self._services.get("supervisor/node/get_field", "node_get_field")
            answer = service(node=self.node(name), fieldName=field)
            self._fields[name, field] = self._known(answer.field, f"{name} has no field {field}")
        return self._fields[name, field]

    def field_type(self, name: str, field: str) -> int:
        """Return the type number of a field of the node with DEF `name`."""
        if (name, field) not in self._types:
            service = self._services.get("supervisor/field/get_type", "field_get_type")
            self._types[name, field] = int(service(field=self.field(name, field)).type)
        return self._types[name, field]

    def forget_handles(self) -> None:
        """Drop all handles; they become invalid when the world is reloaded or the simulator restarts."""
        self._nodes.clear()
        self._fields.clear()
        self._types.clear()
        self._pose_requests.clear()
        self._surroundings.forget()

    def close(self) -> None:
        """Drop handles and connections."""
        self.forget_handles()
        self._services.close()

    def _packed_pose_requests(self, name: str) -> tuple[bytes, bytes]:
        """Return the bytes of both requests for a pose; each step sends them again."""
        node = self.node(name)
        packed = self._position.packed(node=node), self._orientation.packed(node=node)
        self._pose_requests[name] = packed
        return packed

    def _read(self, kind: type[_Data], path: str, most_bytes: int) -> _Data:
        text = self._services.ask(path, "get_string")
        try:
            return kind.from_json(decoded(text.encode(), most_bytes))
        except ProtocolError as error:
            raise WrongData(self.node_name, f"sent an invalid response to {path}: {error}") from error

    def _found(self, handle: Any, fact: str) -> WorldNode:
        return WorldNode(self._services, self._known(handle, fact))

    def _known(self, handle: Any, fact: str) -> int:
        if not handle:
            raise WrongData(self.node_name, fact)
        return int(handle)
