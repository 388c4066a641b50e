"""Stand-ins: simple solids in place of PROTOs that only Webots can run.

A table, `stand_ins.toml`, has one entry a PROTO; a user adds entries of the same form. A stand-in stands
still, even where the PROTO would be pushed or driven. `docs/simulators.md` describes the form.

    [OilBarrel]
    fields = { height = 0.88, radius = 0.305 }    # with their defaults
    cylinder = ["radius", "height"]               # names of fields, or numbers; in meters
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, Final, Literal, TypeAlias

from palaestra_sim.errors import StandInError

ShapeKind = Literal["Box", "Cylinder", "Sphere"]
Size: TypeAlias = "str | float | Sequence[str | float]"
Values = Mapping[str, Sequence[float]]

_SHAPES: Final = {"box": 3, "cylinder": 2, "sphere": 1, "arena": 4, "ring": 3}
_EMPTY: Final = ("flat", "drawn")
_KEYS: Final = frozenset((*_SHAPES, *_EMPTY, "fields", "at", "origin", "translation"))
_RING_SIDES: Final = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One solid of a stand-in, in its frame: a box of x, y, z; or radius and height; or a radius. Meters."""

    kind: ShapeKind
    size: tuple[float, ...]
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading_rad: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class StandIn:
    """One entry of the table.

    Attributes:
        name: of the PROTO.
        fields: its fields that matter, with their defaults.
        shape: "box", "cylinder", "sphere", "arena", "ring"; "" if there is nothing to run into.
        size: of the shape: names of fields or numbers.
        at: the place of its middle in the frame of the PROTO.
        on_floor: whether the frame is at its lower end; otherwise it is in the middle.
        translation: the default of the PROTO's field.
    """

    name: str
    fields: Values = field(default_factory=dict)
    shape: str = ""
    size: tuple[str | float, ...] = ()
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    on_floor: bool = False
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def parts(self, given: Values) -> tuple[Part, ...]:
        """Return the solids of an instance that has these values."""
        numbers = self._numbers({**self.fields, **given})
        match self.shape:
            case "box":
                parts = [Part(kind="Box", size=numbers)]
            case "cylinder":
                parts = [Part(kind="Cylinder", size=numbers)]
            case "sphere":
                parts = [Part(kind="Sphere", size=numbers)]
            case "arena":
                parts = list(_walls(*numbers))
            case "ring":
                parts = list(_ring(*numbers))
            case _:
                parts = []
        return tuple(self._placed(part) for part in parts)

    def _numbers(self, values: Values) -> tuple[float, ...]:
        return tuple(number for item in self.size for number in _evaluated(item, values))

    def _placed(self, part: Part) -> Part:
        lift = _height(part) / 2.0 if self.on_floor else 0.0
        x, y, z = (sum(pair) for pair in zip(part.at, self.at, strict=True))
        return Part(kind=part.kind, size=part.size, at=(x, y, z + lift), heading_rad=part.heading_rad)


def _evaluated(item: str | float, values: Values) -> Sequence[float]:
    """Return the numbers of a field, or of a sum such as `sum widths + 0.06`."""
    if not isinstance(item, str):
        return (item,)
    if item in values:
        return values[item]
    return (sum(sum(_term(term, values)) for term in item.split(" + ")),)


def _term(term: str, values: Values) -> Sequence[float]:
    name = term.removeprefix("sum ")
    return values[name] if name in values else (float(name),)


def _height(part: Part) -> float:
    return 2.0 * part.size[0] if part.kind == "Sphere" else part.size[-1]


def _walls(length: float, width: float, thickness: float, height: float) -> Iterator[Part]:
    """Yield the four walls around a floor."""
    for x, y, size in (
        ((length + thickness) / 2.0, 0.0, (thickness, width, height)),
        (-(length + thickness) / 2.0, 0.0, (thickness, width, height)),
        (0.0, (width + thickness) / 2.0, (length + 2.0 * thickness, thickness, height)),
        (0.0, -(width + thickness) / 2.0, (length + 2.0 * thickness, thickness, height)),
    ):
        yield Part(kind="Box", size=size, at=(x, y, 0.0))


def _ring(radius: float, thickness: float, height: float) -> Iterator[Part]:
    """Yield the pieces of a round wall, whose inner faces touch the circle."""
    side = 2.0 * (radius + thickness) * math.tan(math.pi / _RING_SIDES)
    middle = radius + thickness / 2.0
    for index in range(_RING_SIDES):
        angle = 2.0 * math.pi * index / _RING_SIDES
        at = (middle * math.cos(angle), middle * math.sin(angle), 0.0)
        yield Part(kind="Box", size=(thickness, side, height), at=at, heading_rad=angle)


@cache
def shipped() -> Mapping[str, StandIn]:
    """Return the table that ships."""
    table = resources.files("palaestra_sim.world").joinpath("stand_ins.toml")
    return load(table.read_text("utf-8"), table.name)


def load(text: str, name: str) -> Mapping[str, StandIn]:
    """Return the entries of a table; `name` is its name in errors.

    Raises:
        StandInError: the text is no such table; the message has entry, fact and remedy.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StandInError(f"{name}: {error}; see docs/simulators.md") from error
    return {proto: _entry(f"{name}: {proto}", proto, entry) for proto, entry in table.items()}


def _entry(where: str, proto: str, entry: Any) -> StandIn:
    if not isinstance(entry, dict):
        raise StandInError(f"{where}: is no table; write [{proto}] and its lines below")
    if unknown := sorted(set(entry) - _KEYS):
        raise StandInError(f"{where}.{unknown[0]}: no such key; use {', '.join(sorted(_KEYS))}")
    shapes = [key for key in (*_SHAPES, *_EMPTY) if key in entry]
    if len(shapes) != 1:
        raise StandInError(
            f"{where}: has {len(shapes)} shapes; write one of {', '.join((*_SHAPES, *_EMPTY))}"
        )
    (shape,) = shapes
    fields = {
        name: _vector(f"{where}.fields.{name}", value) for name, value in entry.get("fields", {}).items()
    }
    size = () if shape in _EMPTY else _size(f"{where}.{shape}", entry[shape], fields, _SHAPES[shape])
    origin = entry.get("origin", "center")
    if origin not in {"center", "floor"}:
        raise StandInError(f"{where}.origin: is {origin!r}; write center or floor")
    return StandIn(
        name=proto,
        fields=fields,
        shape="" if shape in _EMPTY else shape,
        size=size,
        at=_triple(f"{where}.at", entry.get("at", (0.0, 0.0, 0.0))),
        on_floor=origin == "floor",
        translation=_triple(f"{where}.translation", entry.get("translation", (0.0, 0.0, 0.0))),
    )


def _size(where: str, given: Any, fields: Values, count: int) -> tuple[str | float, ...]:
    items = given if isinstance(given, list) else [given]
    found = 0
    size: list[str | float] = []
    for item in items:
        if isinstance(item, str):
            try:
                found += len(_evaluated(item, fields))
            except ValueError:
                raise StandInError(
                    f"{where}: {item!r} is no sum of fields and numbers; add it to fields"
                ) from None
            size.append(item)
        else:
            (number,) = _vector(where, item)
            found += 1
            size.append(number)
    if found != count:
        raise StandInError(f"{where}: has {found} numbers; write {count}, in meters")
    return tuple(size)


def _vector(where: str, given: Any) -> tuple[float, ...]:
    items = given if isinstance(given, list | tuple) else [given]
    numbers = tuple(
        float(item) for item in items if isinstance(item, int | float) and not isinstance(item, bool)
    )
    if len(numbers) != len(items) or not all(map(math.isfinite, numbers)):
        raise StandInError(f"{where}: {given!r} is not a number or a list of numbers")
    return numbers


def _triple(where: str, given: Any) -> tuple[float, float, float]:
    numbers = _vector(where, given)
    if len(numbers) != 3:  # noqa: PLR2004 - x, y, z
        raise StandInError(f"{where}: has {len(numbers)} numbers; write x, y, z in meters")
    return numbers[0], numbers[1], numbers[2]
