"""Services under `supervisor/node/`: read the type and the pose of a node, and change the node."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from functools import partial
from typing import Any, Final, cast

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_interfaces import Fields, Row, Service
from palaestra_sim.scene.geometry import Matrix, to_quaternion
from palaestra_sim.webots.library import Library
from palaestra_sim.webots.services.handles import WebotsHandles

_DONE: Final = {"success": 1}
_NODE: Final = "supervisor_node_"


class WebotsNodeServices:
    """The services of one supervisor that take the handle of a node."""

    def __init__(self, library: Library, handles: WebotsHandles) -> None:
        self._library = library
        self._handles = handles

    def table(self) -> tuple[Service, ...]:
        """Return the services, with their paths relative to the robot."""
        return tuple(
            Service(f"supervisor/node/{name}", f"webots_ros/{type_name}", handler)
            for name, type_name, handler in (
                *self._facts(),
                *self._fields(),
                *self._poses(),
                *self._tracking(),
                *self._orders(),
                *self._changes(),
            )
        )

    def _call(self, name: str) -> Callable[..., Any]:
        function: Callable[..., Any] = getattr(self._library, _NODE + name)
        return function

    def _facts(self) -> tuple[Row, ...]:
        facts = (
            ("get_id", "node_get_id", "id"),
            ("get_type", "node_get_type", "type"),
            ("get_type_name", "node_get_name", "name"),
            ("get_def", "node_get_name", "name"),
            ("get_base_type_name", "node_get_name", "name"),
            ("is_proto", "node_is_proto", "value"),
            ("export_string", "node_get_string", "value"),
        )
        return (
            *((name, type_name, partial(self._fact, name, key)) for name, type_name, key in facts),
            ("get_parent_node", "node_get_parent_node", self._get_parent),
            ("get_static_balance", "node_get_static_balance", self._get_static_balance),
        )

    def _fact(self, name: str, key: str, request: Any) -> Fields:
        return {key: self._call(name)(self._handles.node(request.node))}

    def _get_parent(self, request: Any) -> Fields:
        parent = self._call("get_parent_node")(self._handles.node(request.node))
        return {"node": self._handles.of_node(parent)}

    def _get_static_balance(self, request: Any) -> Fields:
        return {"balance": int(self._call("get_static_balance")(self._handles.node(request.node)))}

    def _fields(self) -> tuple[Row, ...]:
        return (
            ("get_field", "node_get_field", self._get_field),
            ("get_field_by_index", "node_get_field_by_index", self._get_field_by_index),
            ("get_number_of_fields", "node_get_number_of_fields", self._get_number_of_fields),
        )

    def _get_field(self, request: Any) -> Fields:
        get = (
            self._inner("get_base_node_field", "get_proto_field")
            if request.proto
            else self._call("get_field")
        )
        return {"field": self._handles.of_field(get(self._handles.node(request.node), request.fieldName))}

    def _get_field_by_index(self, request: Any) -> Fields:
        get = self._call("get_field_by_index")
        if request.proto:
            get = self._inner("get_base_node_field_by_index", "get_proto_field_by_index")
        return {"field": self._handles.of_field(get(self._handles.node(request.node), request.index))}

    def _get_number_of_fields(self, request: Any) -> Fields:
        get = self._call("get_number_of_fields")
        if request.proto:
            get = self._inner("get_number_of_base_node_fields", "get_proto_number_of_fields")
        return {"value": get(self._handles.node(request.node))}

    def _inner(self, name: str, old_name: str) -> Callable[..., Any]:
        """Return a function for the inner fields of a PROTO; R2025a gave it another name."""
        return self._call(name if self._library.has(_NODE + name) else old_name)

    def _poses(self) -> tuple[Row, ...]:
        return (
            ("get_position", "node_get_position", self._get_position),
            ("get_orientation", "node_get_orientation", self._get_orientation),
            ("get_pose", "node_get_pose", self._get_pose),
            ("get_velocity", "node_get_velocity", self._get_velocity),
            ("get_center_of_mass", "node_get_center_of_mass", self._get_center_of_mass),
            ("get_contact_points", "node_get_contact_points", self._get_contact_points),
        )

    def _numbers(self, name: str, *nodes: int | None) -> tuple[float, ...]:
        """Return an array that describes a node.

        Raises:
            ServiceFailed: the node has no such quantity, for example a Shape has no pose.
        """
        values: tuple[float, ...] | None = self._call(name)(*nodes)
        if values is None or math.isnan(values[0]):
            type_name = self._call("get_type_name")(nodes[0])
            raise ServiceFailed(f"{name} of a {type_name} has no value; use a Pose, Solid or Robot")
        return values

    def _get_position(self, request: Any) -> Fields:
        return {"position": _point(self._numbers("get_position", self._handles.node(request.node)))}

    def _get_orientation(self, request: Any) -> Fields:
        matrix = self._numbers("get_orientation", self._handles.node(request.node))
        return {"orientation": _quaternion(matrix)}

    def _get_pose(self, request: Any) -> Fields:
        """Return the pose of `from_node` relative to `node`; Webots' controller swaps the nodes, too."""
        reference, node = self._handles.node(request.node), self._handles.node(request.from_node)
        matrix = self._numbers("get_pose", node, reference)
        rows = (matrix[0:4], matrix[4:8], matrix[8:12])
        return {
            "pose": {
                "translation": _point(tuple(row[3] for row in rows)),
                "rotation": _quaternion(tuple(value for row in rows for value in row[:3])),
            }
        }

    def _get_velocity(self, request: Any) -> Fields:
        values = self._numbers("get_velocity", self._handles.node(request.node))
        return {"velocity": {"linear": _point(values[:3]), "angular": _point(values[3:])}}

    def _get_center_of_mass(self, request: Any) -> Fields:
        center = self._numbers("get_center_of_mass", self._handles.node(request.node))
        return {"centerOfMass": _point(center)}

    def _get_contact_points(self, request: Any) -> Fields:
        size = ctypes.c_int(0)
        node = self._handles.node(request.node)
        found = self._call("get_contact_points")(node, request.include_descendants, ctypes.byref(size))
        points = found[: max(0, size.value)] if found else []
        return {
            "contact_points": [{"point": _point(tuple(it.point)), "node_id": it.node_id} for it in points]
        }

    def _tracking(self) -> tuple[Row, ...]:
        contacts = "contact_points_tracking"
        return (
            ("enable_pose_tracking", "node_enable_pose_tracking", self._track_pose),
            ("disable_pose_tracking", "node_disable_pose_tracking", self._forget_pose),
            (f"enable_{contacts}", f"node_enable_{contacts}", self._track_contacts),
            (f"disable_{contacts}", f"node_disable_{contacts}", self._forget_contacts),
        )

    def _track_pose(self, request: Any) -> Fields:
        node, reference = self._handles.node(request.node), self._handles.other_node(request.from_node)
        self._call("enable_pose_tracking")(node, request.sampling_period, reference)
        return _DONE

    def _forget_pose(self, request: Any) -> Fields:
        node, reference = self._handles.node(request.node), self._handles.other_node(request.from_node)
        self._call("disable_pose_tracking")(node, reference)
        return _DONE

    def _track_contacts(self, request: Any) -> Fields:
        node = self._handles.node(request.node)
        self._call("enable_contact_points_tracking")(
            node, request.sampling_period, request.include_descendants
        )
        return _DONE

    def _forget_contacts(self, request: Any) -> Fields:
        self._call("disable_contact_points_tracking")(self._handles.node(request.node))
        return _DONE

    def _orders(self) -> tuple[Row, ...]:
        orders = {
            "move_viewpoint": "node_move_viewpoint",
            "remove": "node_remove",
            "reset_physics": "node_reset_functions",
            "restart_controller": "node_reset_functions",
        }
        return tuple((name, type_name, partial(self._order, name)) for name, type_name in orders.items())

    def _order(self, name: str, request: Any) -> Fields:
        self._call(name)(self._handles.node(request.node))
        return _DONE

    def _changes(self) -> tuple[Row, ...]:
        return (
            ("set_velocity", "node_set_velocity", self._set_velocity),
            ("add_force", "node_add_force_or_torque", partial(self._push, "add_force")),
            ("add_torque", "node_add_force_or_torque", partial(self._push, "add_torque")),
            ("add_force_with_offset", "node_add_force_with_offset", self._push_with_offset),
            ("set_visibility", "node_set_visibility", self._set_visibility),
            ("save_state", "node_set_string", partial(self._state, "save_state")),
            ("load_state", "node_set_string", partial(self._state, "load_state")),
            ("set_joint_position", "node_set_joint_position", self._set_joint_position),
        )

    def _set_velocity(self, request: Any) -> Fields:
        wanted = request.velocity
        self._call("set_velocity")(
            self._handles.node(request.node), (*_vector(wanted.linear), *_vector(wanted.angular))
        )
        return _DONE

    def _push(self, name: str, request: Any) -> Fields:
        node = self._handles.node(request.node)
        self._call(name)(node, _vector(request.force), bool(request.relative))
        return _DONE

    def _push_with_offset(self, request: Any) -> Fields:
        node = self._handles.node(request.node)
        force, offset = _vector(request.force), _vector(request.offset)
        self._call("add_force_with_offset")(node, force, offset, bool(request.relative))
        return _DONE

    def _set_visibility(self, request: Any) -> Fields:
        """Show or hide a node for a camera, or for the Viewpoint; Webots refuses other nodes and 0."""
        node, viewer = self._handles.node(request.node), self._handles.other_node(request.from_)
        self._call("set_visibility")(node, viewer, bool(request.visible))
        return _DONE

    def _state(self, name: str, request: Any) -> Fields:
        self._call(name)(self._handles.node(request.node), request.state_name)
        return _DONE

    def _set_joint_position(self, request: Any) -> Fields:
        node = self._handles.node(request.node)
        self._call("set_joint_position")(node, request.position, request.index)
        return {"success": True}


def _vector(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def _point(values: tuple[float, ...]) -> Fields:
    return dict(zip("xyz", values, strict=True))


def _quaternion(matrix: tuple[float, ...]) -> Fields:
    return dict(zip("xyzw", to_quaternion(cast("Matrix", matrix)), strict=True))
