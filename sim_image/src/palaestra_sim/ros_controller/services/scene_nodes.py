"""Services under `supervisor/node/`: read the type and the pose of a node, and change the node.

If the simulator does not support a request, such as a force in the stub, the call fails with the reason. A
hint that affects only Webots' speed or rendering returns success and has no effect.
"""

from __future__ import annotations

from typing import Any

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.handles import Handles
from palaestra_sim.ros_controller.host import Host
from palaestra_sim.ros_interfaces import Row, Service
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector, to_quaternion, transposed
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.nodes.types import type_number
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.tree.field_types import kinds_of

Fields = dict[str, Any]


class NodeServices:
    """The services of one supervisor that take the handle of a node."""

    def __init__(self, host: Host, handles: Handles) -> None:
        self._host = host
        self._handles = handles

    def table(self) -> tuple[Service, ...]:
        """Return the services, with their paths relative to the robot."""
        return tuple(
            Service(f"supervisor/node/{name}", f"webots_ros/{type_name}", handler)
            for name, type_name, handler in (*self._what(), *self._where(), *self._changes())
        )

    def _what(self) -> tuple[Row, ...]:
        return (
            ("get_id", "node_get_id", self._get_id),
            ("get_type", "node_get_type", self._get_type),
            ("get_type_name", "node_get_name", self._get_type_name),
            ("get_def", "node_get_name", self._get_def),
            ("get_base_type_name", "node_get_name", self._get_base_type_name),
            ("get_parent_node", "node_get_parent_node", self._get_parent),
            ("is_proto", "node_is_proto", self._is_proto),
            ("get_field", "node_get_field", self._get_field),
            ("get_field_by_index", "node_get_field_by_index", self._get_field_by_index),
            ("get_number_of_fields", "node_get_number_of_fields", self._get_number_of_fields),
            ("export_string", "node_get_string", self._export_string),
        )

    def _where(self) -> tuple[Row, ...]:
        tracking = "contact_points_tracking"
        return (
            ("get_position", "node_get_position", self._get_position),
            ("get_orientation", "node_get_orientation", self._get_orientation),
            ("get_pose", "node_get_pose", self._get_pose),
            ("enable_pose_tracking", "node_enable_pose_tracking", self._accept),
            ("disable_pose_tracking", "node_disable_pose_tracking", self._accept),
            ("get_velocity", "node_get_velocity", self._get_velocity),
            ("get_center_of_mass", "node_get_center_of_mass", self._get_center_of_mass),
            ("get_static_balance", "node_get_static_balance", self._get_static_balance),
            ("get_contact_points", "node_get_contact_points", self._get_contact_points),
            (f"enable_{tracking}", f"node_enable_{tracking}", self._accept),
            (f"disable_{tracking}", f"node_disable_{tracking}", self._accept),
        )

    def _changes(self) -> tuple[Row, ...]:
        return (
            ("set_velocity", "node_set_velocity", self._set_velocity),
            ("add_force", "node_add_force_or_torque", self._add_force),
            ("add_force_with_offset", "node_add_force_with_offset", self._add_force_with_offset),
            ("add_torque", "node_add_force_or_torque", self._add_torque),
            ("move_viewpoint", "node_move_viewpoint", self._accept),
            ("set_visibility", "node_set_visibility", self._accept),
            ("remove", "node_remove", self._remove),
            ("reset_physics", "node_reset_functions", self._reset_physics),
            ("restart_controller", "node_reset_functions", self._restart_controller),
            ("save_state", "node_set_string", self._save_state),
            ("load_state", "node_set_string", self._load_state),
            ("set_joint_position", "node_set_joint_position", self._set_joint_position),
        )

    def _node(self, request: Any) -> SceneNode:
        return self._handles.node(request.node)

    def _robot(self, node: SceneNode) -> Robot | None:
        return self._handles.simulation.robot_of(node)

    def _get_id(self, request: Any) -> Fields:
        return {"id": self._node(request).number}

    def _get_type(self, request: Any) -> Fields:
        return {"type": type_number(self._node(request).type_name)}

    def _get_type_name(self, request: Any) -> Fields:
        """Return the name of the node's PROTO, or its type if it is not an instance of a PROTO."""
        node = self._node(request)
        return {"name": node.proto_name or node.type_name}

    def _get_base_type_name(self, request: Any) -> Fields:
        return {"name": self._node(request).type_name}

    def _get_def(self, request: Any) -> Fields:
        return {"name": self._node(request).def_name}

    def _get_parent(self, request: Any) -> Fields:
        return {"node": self._handles.of(self._node(request).parent)}

    def _is_proto(self, request: Any) -> Fields:
        return {"value": bool(self._node(request).proto_name)}

    def _get_position(self, request: Any) -> Fields:
        return {"position": _point(_place(self._node(request)).world_position)}

    def _get_orientation(self, request: Any) -> Fields:
        return {"orientation": _quaternion(_pose(self._node(request)))}

    def _get_pose(self, request: Any) -> Fields:
        """Return the pose of `from_node` relative to `node`.

        The names of these two fields suggest the opposite, but Webots' controller swaps the nodes in this
        way. If `from_node` is 0, Webots crashes; here the call fails.
        """
        node = _pose(self._node(request))
        other = _pose(self._handles.node(request.from_node))
        to_node = transposed(node.rotation)
        x, y, z = (b - a for a, b in zip(node.position, other.position, strict=True))
        relative = Pose((0.0, 0.0, 0.0), to_node).after(Pose((x, y, z), other.rotation))
        return {
            "pose": {
                "translation": _point(relative.position),
                "rotation": _quaternion(relative),
            }
        }

    def _get_center_of_mass(self, request: Any) -> Fields:
        return {"centerOfMass": _point(self._handles.simulation.motion.center_of_mass(self._node(request)))}

    def _get_static_balance(self, request: Any) -> Fields:
        self._node(request)
        return {"balance": 1}

    def _get_contact_points(self, request: Any) -> Fields:
        found = self._handles.simulation.contact_points(
            self._node(request), descendants=request.include_descendants
        )
        points = [{"point": _point(point), "node_id": number} for point, number in found]
        return {"contact_points": points}

    def _get_velocity(self, request: Any) -> Fields:
        linear, angular = self._handles.simulation.motion.velocity(self._node(request))
        return {"velocity": {"linear": _point(linear), "angular": _point(angular)}}

    def _set_velocity(self, request: Any) -> Fields:
        wanted = request.velocity
        self._handles.simulation.motion.set_velocity(
            self._node(request), _vector(wanted.linear), _vector(wanted.angular)
        )
        return {"success": 1}

    def _add_force(self, request: Any) -> Fields:
        self._handles.simulation.motion.add_force(
            self._node(request), _vector(request.force), relative=bool(request.relative)
        )
        return {"success": 1}

    def _add_force_with_offset(self, request: Any) -> Fields:
        self._handles.simulation.motion.add_force(
            self._node(request),
            _vector(request.force),
            relative=bool(request.relative),
            offset=_vector(request.offset),
        )
        return {"success": 1}

    def _add_torque(self, request: Any) -> Fields:
        self._handles.simulation.motion.add_torque(
            self._node(request), _vector(request.force), relative=bool(request.relative)
        )
        return {"success": 1}

    def _get_field(self, request: Any) -> Fields:
        node = self._node(request)
        field = self._handles.field_of(node, request.fieldName) if _has_fields(node, request) else None
        return {"field": self._handles.of(field)}

    def _get_field_by_index(self, request: Any) -> Fields:
        node = self._node(request)
        names = list(kinds_of(node))
        if not _has_fields(node, request) or not 0 <= request.index < len(names):
            return {"field": 0}
        field = self._handles.field_of(node, names[request.index])
        return {"field": self._handles.of(field)}

    def _get_number_of_fields(self, request: Any) -> Fields:
        node = self._node(request)
        return {"value": len(kinds_of(node)) if _has_fields(node, request) else -1}

    def _export_string(self, request: Any) -> Fields:
        """Return the text of the node in the world file."""
        origin = self._node(request).origin
        if origin is None:
            return {"value": self._handles.tree.source.decode()}
        start, end = origin.node.span
        return {"value": origin.source.data[start:end].decode()}

    def _remove(self, request: Any) -> Fields:
        self._handles.simulation.remove(self._node(request))
        return {"success": 1}

    def _save_state(self, request: Any) -> Fields:
        self._handles.simulation.save_state(self._node(request), request.state_name)
        return {"success": 1}

    def _load_state(self, request: Any) -> Fields:
        self._handles.simulation.load_state(self._node(request), request.state_name)
        return {"success": 1}

    def _set_joint_position(self, request: Any) -> Fields:
        node = self._node(request)
        self._handles.simulation.set_joint_position(node, request.position, request.index)
        return {"success": True}

    def _reset_physics(self, request: Any) -> Fields:
        self._handles.simulation.motion.halt(self._node(request))
        return {"success": 1}

    def _restart_controller(self, request: Any) -> Fields:
        robot = self._robot(self._node(request))
        if robot is not None:
            self._host.restart(robot)
        return {"success": 1}

    def _accept(self, request: Any) -> Fields:
        """Accept a hint that affects only the speed of Webots' responses, or only Webots' rendering."""
        self._node(request)
        return {"success": 1}


def _has_fields(node: SceneNode, request: Any) -> bool:
    """Return whether a node has the requested fields; only an instance of a PROTO has inner fields."""
    return bool(node.proto_name) or not request.proto


def _pose(node: SceneNode) -> Pose:
    """Return the pose of a node in the world."""
    return _place(node).world_pose


def _place(node: SceneNode) -> Frame:
    """Return the frame of a node.

    Webots' controller crashes for a node without a frame.

    Raises:
        ServiceFailed: the node has no frame.
    """
    if node.place is None:
        raise ServiceFailed(f"a {node.type_name} has no position; use a Pose, Solid or Robot")
    return node.place


def _vector(point: Any) -> Vector:
    return point.x, point.y, point.z


def _point(vector: tuple[float, float, float]) -> Fields:
    return {"x": vector[0], "y": vector[1], "z": vector[2]}


def _quaternion(pose: Pose) -> Fields:
    x, y, z, w = to_quaternion(pose.rotation)
    return {"x": x, "y": y, "z": z, "w": w}
