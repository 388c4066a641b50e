"""Services under `supervisor/field/`: read and write the values of fields by handle.

If a client writes a value that the field cannot hold, the call returns success 1, as in Webots' controller.
If Webots would apply a write that this simulator cannot apply, the call fails with the reason. If a client
reads a value of the wrong type, the result is 0 or "", as in libController. For vectors, rotations and colors
libController returns a null pointer, which crashes Webots' controller; here the call fails.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final, NamedTuple

from palaestra_sim.ros_controller.handles import Handles
from palaestra_sim.ros_interfaces import Row, Service
from palaestra_sim.scene.geometry import axis_angle_to_quaternion
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.scene.tree.fields import NodeField, NoValueError, quaternion_to_axis_angle

Fields = dict[str, Any]


class _Codec(NamedTuple):
    """Converts the values of a field type to and from messages.

    `absent` is the result of a read if the field has no value of this type. None means that the read fails.
    """

    type: FieldType
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]
    absent: Any = None


def _vector_out(value: tuple[float, ...]) -> Fields:
    return {"x": value[0], "y": value[1], "z": value[2] if len(value) > 2 else 0.0}  # noqa: PLR2004 - vec2f has no z


def _rotation_out(value: tuple[float, float, float, float]) -> Fields:
    return dict(zip("xyzw", axis_angle_to_quaternion(value), strict=True))


def _color_out(value: tuple[float, ...]) -> Fields:
    return {"r": value[0], "g": value[1], "b": value[2], "a": 1.0}


_CODECS: Final = {
    "bool": _Codec(FieldType.BOOL, int, bool, 0),
    "int32": _Codec(FieldType.INT32, int, int, 0),
    "float": _Codec(FieldType.FLOAT, float, float, 0.0),
    "vec2f": _Codec(FieldType.VEC2F, _vector_out, lambda v: (v.x, v.y)),
    "vec3f": _Codec(FieldType.VEC3F, _vector_out, lambda v: (v.x, v.y, v.z)),
    "rotation": _Codec(
        FieldType.ROTATION, _rotation_out, lambda q: quaternion_to_axis_angle(q.x, q.y, q.z, q.w)
    ),
    "color": _Codec(FieldType.COLOR, _color_out, lambda c: (c.r, c.g, c.b)),
    "string": _Codec(FieldType.STRING, str, str, ""),
}


class FieldServices:
    """The services of one supervisor that take the handle of a field."""

    def __init__(self, handles: Handles) -> None:
        self._handles = handles

    def table(self) -> tuple[Service, ...]:
        """Return the services, with their paths relative to the robot."""
        rows: list[Row] = [
            ("get_name", "field_get_name", self._get_name),
            ("get_type", "field_get_type", self._get_type),
            ("get_type_name", "field_get_name", self._get_type_name),
            ("get_count", "field_get_count", self._get_count),
            ("get_node", "field_get_node", self._get_node),
            ("remove", "field_remove", self._remove),
            ("import_node_from_string", "field_import_node_from_string", self._import_node),
            ("remove_node", "field_remove_node", self._remove_node),
            ("enable_sf_tracking", "field_enable_sf_tracking", self._accept),
            ("disable_sf_tracking", "field_disable_sf_tracking", self._accept),
        ]
        for name, codec in _CODECS.items():
            rows.append((f"get_{name}", f"field_get_{name}", partial(self._get, codec)))
            rows.append((f"set_{name}", f"field_set_{name}", partial(self._set, codec)))
            rows.append((f"insert_{name}", f"field_set_{name}", partial(self._insert, codec)))
        return tuple(
            Service(f"supervisor/field/{name}", f"webots_ros/{type_name}", handler)
            for name, type_name, handler in rows
        )

    def _field(self, request: Any) -> NodeField:
        return self._handles.field(request.field)

    def _get(self, codec: _Codec, request: Any) -> Fields:
        field = self._field(request)
        try:
            return {"value": codec.write(field.get(codec.type, request.index))}
        except NoValueError:
            if codec.absent is None:
                raise
            return {"value": codec.absent}

    def _set(self, codec: _Codec, request: Any) -> Fields:
        self._field(request).set(codec.type, request.index, codec.read(request.value))
        return {"success": 1}

    def _insert(self, codec: _Codec, request: Any) -> Fields:
        value = codec.read(request.value)
        return {"success": int(self._field(request).insert(codec.type, request.index, value))}

    def _get_name(self, request: Any) -> Fields:
        return {"name": self._field(request).name}

    def _get_type(self, request: Any) -> Fields:
        return {"type": self._field(request).kind.number}

    def _get_type_name(self, request: Any) -> Fields:
        return {"name": self._field(request).kind.name}

    def _get_count(self, request: Any) -> Fields:
        return {"count": self._field(request).count}

    def _get_node(self, request: Any) -> Fields:
        try:
            node = self._field(request).get(FieldType.NODE, request.index)
        except NoValueError:
            node = None
        return {"node": self._handles.of(node)}

    def _remove(self, request: Any) -> Fields:
        field = self._field(request)
        if field.kind.type is FieldType.NODE:
            return self._remove_node_at(field, request.index)
        return {"success": int(field.remove(request.index))}

    def _import_node(self, request: Any) -> Fields:
        field = self._field(request)
        return {"success": int(self._handles.simulation.add(request.nodeString, field, request.position))}

    def _remove_node(self, request: Any) -> Fields:
        return self._remove_node_at(self._field(request), request.position)

    def _remove_node_at(self, field: NodeField, index: int) -> Fields:
        try:
            node = field.get(FieldType.NODE, index)
        except NoValueError:
            node = None
        if node is not None:
            self._handles.simulation.remove(node)
        return {"success": int(node is not None)}

    def _accept(self, request: Any) -> Fields:
        self._field(request)
        return {"success": 1}
