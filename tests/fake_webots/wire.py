"""Requests of the library and results for it, as bytes; libcontroller.c describes them."""

import re
import struct
from pathlib import Path

FOLDER = Path(__file__).parent
NULL = struct.pack("<i", -1)
_OWN = {
    "robot_init": "number",
    "robot_step": "number",
    "robot_wwi_send": "none",
    "emitter_send": "number",
    "display_image_new": "ref",
    "display_draw_polygon": "none",
    "display_fill_polygon": "none",
    "supervisor_node_get_contact_points": "contacts",
}
_LINE = re.compile(r"^F\d\((\w+), (\w+)(?:, (.*))?\)$", re.MULTILINE)


def functions():
    """Return the types of result and arguments of each function that functions.h declares, by name."""
    lines = _LINE.findall((FOLDER / "functions.h").read_text())
    return {name: (result, arguments.split(", ") if arguments else []) for result, name, arguments in lines}


RESULTS = {**{name: result for name, (result, _) in functions().items()}, **_OWN}


def read_request(data):
    """Return the name of a function and its arguments."""
    name, _, rest = data.partition(b"\0")
    arguments, at = [], 0
    while at < len(rest):
        value, at = _argument(rest, at)
        arguments.append(value)
    return name.decode(), arguments


def _argument(data, at):
    kind, at = chr(data[at]), at + 1
    if kind in "idp":
        form = {"i": "<i", "d": "<d", "p": "<Q"}[kind]
        return struct.unpack_from(form, data, at)[0], at + struct.calcsize(form)
    (count,) = struct.unpack_from("<I", data, at)
    at += 4
    if kind == "s":
        return data[at : at + count], at + count
    form = f"<{count}{'d' if kind == 'v' else 'i'}"
    return list(struct.unpack_from(form, data, at)), at + struct.calcsize(form)


def write_result(name, value):
    """Return the result of a function as bytes; None stands for NULL."""
    return _WRITERS[RESULTS[name]](value)


def _array(form):
    def write(values):
        return NULL if values is None else struct.pack(f"<i{len(values)}{form}", len(values), *values)

    return write


def _bytes(value):
    if value is None:
        return NULL
    data = value.encode() if isinstance(value, str) else bytes(value)
    return struct.pack("<i", len(data)) + data


def _structs(form):
    def write(items):
        if items is None:
            return NULL
        return struct.pack("<i", len(items)) + b"".join(struct.pack(form, *item) for item in items)

    return write


def _objects(items):
    parts = [struct.pack("<i", len(items))]
    for number, position, orientation, size, places, colors, model in items:
        parts.append(struct.pack("<i9d4i", number, *position, *orientation, *size, *places))
        parts.append(_array("d")(colors) + _bytes(model))
    return b"".join(parts)


_WRITERS = {
    "none": lambda _value: b"",
    "number": lambda value: struct.pack("<i", int(value)),
    "flag": lambda value: struct.pack("<i", bool(value)),
    "tag": lambda value: struct.pack("<i", value),
    "real": lambda value: struct.pack("<d", value),
    "ref": lambda value: struct.pack("<Q", value or 0),
    "text": _bytes,
    "bytes": _bytes,
    "doubles": _array("d"),
    "floats": _array("f"),
    "points": _structs("<fffif"),
    "targets": _structs("<dddd"),
    "contacts": _structs("<dddii"),
    "objects": _objects,
}
