"""Convert values of fields between Python and the services that read and write them.

In Python a rotation is an axis and an angle, as in a world file. The services take a quaternion instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from palaestra_trainer.errors import ConfigurationError

Value = bool | int | float | str | tuple[float, ...]

_MULTIPLE: Final = 0x10  # Webots adds this to the type number of a field that may have several values
# For an exact identity quaternion, which has no axis, Webots would keep the old rotation and report success.
_SMALLEST_TURN: Final = 1e-6


class FieldCodec(NamedTuple):
    """The type of a field: its name in services, a description of its values, encoder and decoder."""

    name: str
    wanted: str
    to_wire: Callable[[Any], Any]
    from_wire: Callable[[Any], Value]


def kind_of(type_number: int, field: str) -> FieldCodec:
    """Return the codec for the type number of a field; `field` is the field's name in errors.

    Raises:
        ConfigurationError: the field holds nodes, not values.
    """
    kind = _KINDS.get(type_number & ~_MULTIPLE)
    if kind is None:
        raise ConfigurationError(
            f"{field}: holds nodes, not values; call this method with the DEF name of one of these nodes, "
            "and with a field of that node"
        )
    return kind


def encoded(kind: FieldCodec, field: str, value: Value) -> Any:
    """Return `value` in the form that the service of the field takes.

    Raises:
        ConfigurationError: the field cannot hold the value.
    """
    try:
        return kind.to_wire(value)
    except (TypeError, ValueError):
        raise ConfigurationError(f"{field}: {value!r} does not fit; give {kind.wanted}") from None


def turn_about_z(heading_rad: float) -> dict[str, float]:
    """Return the quaternion of a heading in a form that Webots applies even for 0."""
    return _quaternion((0.0, 0.0, 1.0, heading_rad))


def applied_quaternion(x: float, y: float, z: float, w: float) -> dict[str, float]:
    """Return a quaternion of any length as a unit quaternion, in a form that Webots applies even for 0.

    Raises:
        ConfigurationError: all of its numbers are 0, or one is not finite.
    """
    length = math.hypot(x, y, z, w)
    if not (length > 0.0 and math.isfinite(length)):
        raise ConfigurationError(
            f"({x:g}, {y:g}, {z:g}, {w:g}) is not a rotation; give a quaternion x, y, z, w"
        )
    sine = math.hypot(x, y, z) / length
    axis = (x, y, z) if sine else (0.0, 0.0, 1.0)
    return _quaternion((*axis, 2.0 * math.atan2(sine, w / length)))


def _exactly(*types: type) -> Callable[[Any], Any]:
    """Return a check that accepts only these exact types, because a bool must not count as a number."""

    def check(value: Any) -> Any:
        if type(value) not in types:
            raise TypeError
        return value

    return check


def _number(value: Any) -> float:
    number = float(_exactly(int, float)(value.item() if hasattr(value, "item") else value))
    if not math.isfinite(number):
        raise ValueError
    return number


def _numbers(value: Sequence[Any], names: str) -> dict[str, float]:
    return {name: _number(each) for name, each in zip(names, value, strict=True)}


def _vector(value: Sequence[Any]) -> dict[str, float]:
    return _numbers(value, "xyz")


def _plane(value: Sequence[Any]) -> dict[str, float]:
    return {**_numbers(value, "xy"), "z": 0.0}


def _color(value: Sequence[Any]) -> dict[str, float]:
    return {**_numbers(value, "rgb"), "a": 1.0}


def _quaternion(value: Sequence[Any]) -> dict[str, float]:
    x, y, z, angle_rad = map(_number, value)
    length = math.hypot(x, y, z)
    if length == 0.0:
        raise ValueError
    half = math.sin(angle_rad / 2.0)
    if abs(half) < _SMALLEST_TURN:
        half, w = _SMALLEST_TURN, 1.0
    else:
        w = math.cos(angle_rad / 2.0)
    return {"x": x / length * half, "y": y / length * half, "z": z / length * half, "w": w}


def _axis_angle(turn: Any) -> tuple[float, ...]:
    sine = math.hypot(turn.x, turn.y, turn.z)
    angle_rad = 2.0 * math.atan2(sine, turn.w)
    if sine <= _SMALLEST_TURN:
        return (0.0, 0.0, 1.0, 0.0)
    return (turn.x / sine, turn.y / sine, turn.z / sine, angle_rad)


def _part(names: Sequence[str]) -> Callable[[Any], tuple[float, ...]]:
    return lambda message: tuple(float(getattr(message, name)) for name in names)


# Source: WbFieldType of Webots, R2021b to R2023b.
_KINDS: Final[Mapping[int, FieldCodec]] = {
    1: FieldCodec("bool", "True or False", _exactly(bool), bool),
    2: FieldCodec("int32", "a whole number", _exactly(int), int),
    3: FieldCodec("float", "a finite number", _number, float),
    4: FieldCodec("vec2f", "x, y", _plane, _part("xy")),
    5: FieldCodec("vec3f", "x, y, z", _vector, _part("xyz")),
    6: FieldCodec("rotation", "x, y, z of an axis and an angle in radians", _quaternion, _axis_angle),
    7: FieldCodec("color", "red, green, blue from 0 to 1", _color, _part("rgb")),
    8: FieldCodec("string", "text", _exactly(str), str),
}
