"""One node of the world as an object, also a node without a DEF name."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from palaestra_trainer.errors import WrongData
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
        """Return whether both are the same node."""
        return isinstance(other, WorldNode) and other.handle == self.handle

    def __hash__(self) -> int:
        return hash(self.handle)

    @property
    def id(self) -> int:
        """The number of the node, for `Observer.with_id`."""
        return int(self._ask("get_id", "node_get_id").id)

    @property
    def definition(self) -> str:
        """The DEF name; "" without one."""
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
        """Return the nodes in a field; a field of one node has at most one.

        Raises:
            WrongData: also if the node has no such field, or the field does not hold nodes.
        """
        handle = self._ask("get_field", "node_get_field", fieldName=field).field
        if not handle:
            raise WrongData(self._services.node_name, f"{self._name()} has no field {field}")
        if self._of_field("get_type", handle).type not in _NODE_TYPES:
            fact = f"{self._name()}.{field} holds values; read it with get_field"
            raise WrongData(self._services.node_name, fact)
        count = abs(int(self._of_field("get_count", handle).count))  # -1 for a field of one node
        found = [self._of_field("get_node", handle, index=index).node for index in range(count)]
        return tuple(WorldNode(self._services, int(node)) for node in found if node)

    def pose_in(self, frame: WorldNode) -> tuple[Vector, Quaternion]:
        """Return position, in meters, and rotation of this node in the axes of another node.

        The rotation is a quaternion: x, y, z, w.

        Raises:
            WrongData: also if one of the nodes has no position.
        """
        # Webots' controller swaps the two nodes.
        pose = frame._ask("get_pose", "node_get_pose", from_node=self.handle).pose
        at, turn = pose.translation, pose.rotation
        numbers = at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w
        self._services.require_finite("the pose of a node", *numbers)
        return numbers[:3], numbers[3:]

    def track_pose(self, frame: WorldNode, period_ms: int) -> None:
        """Make Webots send `pose_in(frame)` every `period_ms`, so that reading it takes less time.

        0 ends this. The stub and MuJoCo confirm the call, and are as fast without it.
        """
        if period_ms:
            self._command("enable_pose_tracking", sampling_period=period_ms, from_node=frame.handle)
        else:
            self._command("disable_pose_tracking", from_node=frame.handle)

    def track_contacts(self, period_ms: int) -> None:
        """Make Webots send the contact points of the node and its children; see `track_pose`."""
        if period_ms:
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
        refused = f"refuses {service} for {self._name()}"
        path, type_name = f"supervisor/node/{service}", f"node_{service}"
        self._services.confirm(path, type_name, refused, node=self.handle, **request)

    def _ask(self, service: str, type_name: str, **request: Any) -> Any:
        return self._services.get(f"supervisor/node/{service}", type_name)(node=self.handle, **request)
