"""One node of the world as an object, also a node without a DEF name."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from palaestra_trainer.errors import ConfigurationError, WrongData
from palaestra_trainer.webots.fields import Value, kind_of
from palaestra_trainer.webots.services import Services

_NODE_TYPES: Final = (0x09, 0x19)  # the types of SFNode and MFNode. Source: WbFieldType of Webots

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class FieldName(NamedTuple):
    """The name of a node's field, and its type as in Webots' manual, such as SFVec3f."""

    name: str
    type_name: str


class WorldNode:
    """A node, which is known to the simulator by its handle until the world is reloaded.

    `Observer.find` and other methods of the observer return nodes. Every property and method may raise
    SimulatorDead, SimulatorHung or WrongData.

    Args:
        services: the services of the supervisor.
        handle: the handle of the node.
    """

    def __init__(self, services: Services, handle: int) -> None:
        self._services = services
        self.handle = handle

    def __eq__(self, other: object) -> bool:
        """Return whether the other object is the same node of the same simulator."""
        return isinstance(other, WorldNode) and other._key() == self._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        """Return the supervisor and the handle, without a request."""
        return f"WorldNode({self._services.node_name!r}, {self.handle})"

    @property
    def id(self) -> int:
        """The number of the node, for `Observer.with_id`."""
        return int(self._ask("get_id", "node_get_id").id)

    @property
    def definition(self) -> str:
        """The DEF name; "" for a node without a DEF name."""
        return str(self._ask("get_def", "node_get_name").name)

    @property
    def type_name(self) -> str:
        """The type, or the name of the PROTO."""
        return str(self._ask("get_type_name", "node_get_name").name)

    @property
    def base_type_name(self) -> str:
        """The type, also for a PROTO."""
        return str(self._ask("get_base_type_name", "node_get_name").name)

    @property
    def type_number(self) -> int:
        """The number of the type in Webots."""
        return int(self._ask("get_type", "node_get_type").type)

    @property
    def is_proto(self) -> bool:
        """Whether the node is an instance of a PROTO."""
        return bool(self._ask("is_proto", "node_is_proto").value)

    @property
    def parent(self) -> WorldNode | None:
        """The node that contains this node; None for the world itself."""
        handle = self._ask("get_parent_node", "node_get_parent_node").node
        return WorldNode(self._services, int(handle)) if handle else None

    def fields(self) -> tuple[FieldName, ...]:
        """Return the names and types of the node's fields."""
        count = int(self._ask("get_number_of_fields", "node_get_number_of_fields").value)
        return tuple(self._field(index) for index in range(count))

    def nodes(self, field: str = "children") -> tuple[WorldNode, ...]:
        """Return the nodes in a field; a field for a single node holds one node or none.

        If the node has no field `children`, the result is empty.

        Raises:
            WrongData: also if the node has no such field, except `children`, or the field holds values.
        """
        handle = self._ask_for_field(field)
        if not handle and field == "children":
            return ()
        self._require_field(field, handle)
        if self._of_field("get_type", handle).type not in _NODE_TYPES:
            fact = f"{self._name()}.{field} holds values; read it with get_field"
            raise WrongData(self._services.node_name, fact)
        count = abs(int(self._of_field("get_count", handle).count))  # -1 for a field of one node
        found = [self._of_field("get_node", handle, index=index).node for index in range(count)]
        return tuple(WorldNode(self._services, int(node)) for node in found if node)

    def value(self, field: str, index: int = 0) -> Value:
        """Return the value of a field, in the type of the field; see `Supervisor.get_field`.

        Raises:
            ConfigurationError: the field holds nodes.
            WrongData: also if the node has no such field.
        """
        handle = self._handle_of(field)
        kind = kind_of(int(self._of_field("get_type", handle).type), f"{self._name()}.{field}")
        return kind.from_wire(self._of_field(f"get_{kind.name}", handle, index=index).value)

    def text(self) -> str:
        """Return the node as text of a world file, with its current fields."""
        return str(self._ask("export_string", "node_get_string").value)

    def pose(self) -> tuple[Vector, Quaternion]:
        """Return position, in meters, and rotation of the node in the world.

        The rotation is a quaternion: x, y, z, w.

        Raises:
            WrongData: also if the node has no position, as a Group.
        """
        at = self._ask("get_position", "node_get_position").position
        turn = self._ask("get_orientation", "node_get_orientation").orientation
        return self._finite(at, turn)

    def contact_points(self) -> tuple[Vector, ...]:
        """Return the points at which the node, or a part of it, touches other objects; see `Observer`."""
        request = {"include_descendants": True}
        found = self._ask("get_contact_points", "node_get_contact_points", **request).contact_points
        return tuple((it.point.x, it.point.y, it.point.z) for it in found)

    def pose_in(self, frame: WorldNode) -> tuple[Vector, Quaternion]:
        """Return position, in meters, and rotation of this node in the axes of another node.

        The rotation is a quaternion: x, y, z, w.

        Raises:
            WrongData: also if one of the nodes has no position.
        """
        # Webots' controller swaps the two nodes.
        pose = frame._ask("get_pose", "node_get_pose", from_node=self.handle).pose
        return self._finite(pose.translation, pose.rotation)

    def track_pose(self, frame: WorldNode, period_ms: int) -> None:
        """Make Webots send `pose_in(frame)` every `period_ms`, so that reading it takes less time.

        A period of 0 ends this. The stub and MuJoCo confirm the call, and are as fast without it.
        """
        if tracks(period_ms):
            self._command("enable_pose_tracking", sampling_period=period_ms, from_node=frame.handle)
        else:
            self._command("disable_pose_tracking", from_node=frame.handle)

    def track_contacts(self, period_ms: int) -> None:
        """Make Webots send the contact points of the node and its children; see `track_pose`."""
        if tracks(period_ms):
            wanted = {"sampling_period": period_ms, "include_descendants": True}
            self._command("enable_contact_points_tracking", **wanted)
        else:
            self._command("disable_contact_points_tracking")

    def _field(self, index: int) -> FieldName:
        field = self._ask("get_field_by_index", "node_get_field_by_index", index=index).field
        if not field:
            raise WrongData(self._services.node_name, f"the node has no field {index}, but more are counted")
        type_name = self._services.get("supervisor/field/get_type_name", "field_get_name")(field=field).name
        return FieldName(str(self._of_field("get_name", field).name), str(type_name))

    def _of_field(self, service: str, field: int, **request: Any) -> Any:
        return self._services.get(f"supervisor/field/{service}", f"field_{service}")(field=field, **request)

    def _name(self) -> str:
        return self.definition or f"a {self.type_name}"

    def _command(self, service: str, **request: Any) -> None:
        if not self._ask(service, f"node_{service}", **request).success:
            raise WrongData(self._services.node_name, f"refuses {service} for {self._name()}")

    def _handle_of(self, field: str) -> int:
        handle = self._ask_for_field(field)
        self._require_field(field, handle)
        return handle

    def _ask_for_field(self, field: str) -> int:
        return int(self._ask("get_field", "node_get_field", fieldName=field).field)

    def _require_field(self, field: str, handle: int) -> None:
        if not handle:
            raise WrongData(self._services.node_name, f"{self._name()} has no field {field}")

    def _finite(self, at: Any, turn: Any) -> tuple[Vector, Quaternion]:
        numbers = at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w
        if not all(map(math.isfinite, numbers)):
            raise WrongData(self._services.node_name, f"the pose of {self._name()} is not finite: {numbers}")
        return numbers[:3], numbers[3:]

    def _key(self) -> tuple[str, int]:
        return self._services.node_name, self.handle

    def _ask(self, service: str, type_name: str, **request: Any) -> Any:
        return self._services.get(f"supervisor/node/{service}", type_name)(node=self.handle, **request)


def tracks(period_ms: int) -> bool:
    """Return whether a period starts the tracking.

    Raises:
        ConfigurationError: the period is negative.
    """
    if period_ms < 0:
        raise ConfigurationError(f"a period of {period_ms} ms; use a positive one, or 0 to end the tracking")
    return period_ms > 0
