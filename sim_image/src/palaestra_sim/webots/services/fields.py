"""Services under `supervisor/field/`: read and write the values of fields by handle."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Final, NamedTuple

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_interfaces import Fields, Row, Service
from palaestra_sim.scene.geometry import axis_angle_to_quaternion, quaternion_to_matrix, to_axis_angle
from palaestra_sim.webots.library import Library
from palaestra_sim.webots.services.handles import WebotsHandles

_MULTIPLE: Final = 0x10  # WB_MF: this bit is set in the type of a field with many values
_SINGLE_NODE, _NODES = 0x09, 0x19


class _Conversion(NamedTuple):
    """Converts the values of a field type to and from messages."""

    write: Callable[[Any], Any]
    read: Callable[[Any], Any]


def _named(names: str) -> Callable[[tuple[float, ...]], Fields]:
    return lambda values: dict(zip(names, values, strict=False))


_CONVERSIONS: Final = {
    "bool": _Conversion(int, bool),
    "int32": _Conversion(int, int),
    "float": _Conversion(float, float),
    "vec2f": _Conversion(lambda v: {"x": v[0], "y": v[1], "z": 0.0}, lambda it: (it.x, it.y)),
    "vec3f": _Conversion(_named("xyz"), lambda it: (it.x, it.y, it.z)),
    "rotation": _Conversion(
        lambda v: _named("xyzw")(axis_angle_to_quaternion(v)),
        lambda it: to_axis_angle(quaternion_to_matrix((it.x, it.y, it.z, it.w))),
    ),
    "color": _Conversion(lambda v: {**_named("rgb")(v), "a": 1.0}, lambda it: (it.r, it.g, it.b)),
    "string": _Conversion(str, str),
}


class WebotsFieldServices:
    """The services of one supervisor that take the handle of a field."""

    def __init__(self, library: Library, handles: WebotsHandles) -> None:
        self._library = library
        self._handles = handles

    def table(self) -> tuple[Service, ...]:
        """Return the services, with their paths relative to the robot."""
        rows: list[Row] = [
            ("get_name", "field_get_name", partial(self._fact, "get_name", "name")),
            ("get_type", "field_get_type", partial(self._fact, "get_type", "type")),
            ("get_type_name", "field_get_name", partial(self._fact, "get_type_name", "name")),
            ("get_count", "field_get_count", partial(self._fact, "get_count", "count")),
            ("get_node", "field_get_node", self._get_node),
            ("remove", "field_remove", self._remove),
            ("import_node_from_string", "field_import_node_from_string", self._import_node),
            ("remove_node", "field_remove_node", self._remove_node),
            ("enable_sf_tracking", "field_enable_sf_tracking", self._track),
            ("disable_sf_tracking", "field_disable_sf_tracking", self._forget),
        ]
        for name in _CONVERSIONS:
            rows.append((f"get_{name}", f"field_get_{name}", partial(self._get, name)))
            rows.append((f"set_{name}", f"field_set_{name}", partial(self._set, name)))
            rows.append((f"insert_{name}", f"field_set_{name}", partial(self._insert, name)))
        return tuple(
            Service(f"supervisor/field/{name}", f"webots_ros/{type_name}", handler)
            for name, type_name, handler in rows
        )

    def _call(self, name: str) -> Callable[..., Any]:
        function: Callable[..., Any] = getattr(self._library, f"supervisor_field_{name}")
        return function

    def _type(self, field: int) -> int:
        number: int = self._call("get_type")(field)
        return number

    def _fact(self, name: str, key: str, request: Any) -> Fields:
        return {key: self._call(name)(self._handles.field(request.field))}

    def _read(self, type_name: str, field: int, index: int) -> Any:
        if self._type(field) & _MULTIPLE:
            return self._call(f"get_mf_{type_name}")(field, index)
        return self._call(f"get_sf_{type_name}")(field)

    def _get(self, type_name: str, request: Any) -> Fields:
        field = self._handles.field(request.field)
        value = self._read(type_name, field, request.index)
        if value is None:
            kind, name = self._call("get_type_name")(field), self._call("get_name")(field)
            raise ServiceFailed(
                f"{name!r} is of the type {kind} and has no {type_name} at {request.index}; "
                "use the service of its type and an index that exists"
            )
        return {"value": _CONVERSIONS[type_name].write(value)}

    def _set(self, type_name: str, request: Any) -> Fields:
        field, value = self._handles.field(request.field), _CONVERSIONS[type_name].read(request.value)
        if self._type(field) & _MULTIPLE:
            self._call(f"set_mf_{type_name}")(field, request.index, value)
        else:
            self._call(f"set_sf_{type_name}")(field, value)
        return {"success": 1}

    def _insert(self, type_name: str, request: Any) -> Fields:
        field = self._handles.field(request.field)
        if not self._type(field) & _MULTIPLE:
            return {"success": 0}
        value = _CONVERSIONS[type_name].read(request.value)
        self._call(f"insert_mf_{type_name}")(field, request.index, value)
        return {"success": 1}

    def _get_node(self, request: Any) -> Fields:
        node = self._read("node", self._handles.field(request.field), request.index)
        return {"node": self._handles.of_node(node)}

    def _remove(self, request: Any) -> Fields:
        field = self._handles.field(request.field)
        kind = self._type(field)
        if kind == _SINGLE_NODE:
            self._call("remove_sf")(field)
        elif kind & _MULTIPLE:
            self._call("remove_mf")(field, request.index)
        else:
            return {"success": 0}
        return {"success": 1}

    def _import_node(self, request: Any) -> Fields:
        field = self._handles.field(request.field)
        kind = self._type(field)
        if kind == _SINGLE_NODE:
            self._call("import_sf_node_from_string")(field, request.nodeString)
        elif kind == _NODES:
            self._call("import_mf_node_from_string")(field, request.position, request.nodeString)
        else:
            return {"success": 0}
        return {"success": 1}

    def _remove_node(self, request: Any) -> Fields:
        self._call("remove_mf")(self._handles.field(request.field), request.position)
        return {"success": 1}

    def _track(self, request: Any) -> Fields:
        self._call("enable_sf_tracking")(self._handles.field(request.field), request.sampling_period)
        return {"success": 1}

    def _forget(self, request: Any) -> Fields:
        self._call("disable_sf_tracking")(self._handles.field(request.field))
        return {"success": 1}
