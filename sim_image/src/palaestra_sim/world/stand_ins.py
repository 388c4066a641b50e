"""Stand-ins: descriptions of PROTOs whose files are not read, by their fields and a few simple shapes.

A file of stand-ins is a TOML file with one table for each type:

    [WoodenBox]
    fields = '''
    SFVec3f size 0.6 0.6 0.6
    SFFloat mass 0
    '''
    box = "size"

`fields` declares the fields and their defaults in the syntax of a PROTO, which Webots' manual uses too. Every
object also has `translation`, `rotation` and `name`. An entry has one shape (`box`, `cylinder`, `sphere`,
`plane`, `ring` or `wall`), or a list of shapes in `parts`. Lengths are numbers or formulas
(`expressions.py`). The lists `flat` and `drawn` at the top of the file name types without obstacles: `flat`
objects lie on the ground, and `drawn` objects are only visible.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NoReturn, TypeAlias

from palaestra_sim.errors import StandInError, WorldError
from palaestra_sim.world.expressions import Expression, parse_formula
from palaestra_sim.world.parts import LENGTHS, Form, FormKind, ShapePart
from palaestra_sim.world.proto import ProtoField, parse_fields
from palaestra_sim.world.tree import Item

_SHIPPED = Path(__file__).parent / "stand_ins.toml"
_LISTS: tuple[Literal["flat", "drawn"], ...] = ("flat", "drawn")
_OPTIONS = frozenset(("at", "origin", "turn", "when", "unless"))
_AXES = {"Float": 0, "Int32": 0, "Bool": 0, "Vec2f": 2, "Vec3f": 3, "Color": 3, "Rotation": 3}
_FIELDS_OF_FORM: dict[FormKind, tuple[str, ...]] = {
    "cylinder": ("radius", "height"),
    "ring": ("radius", "thickness", "height"),
    "wall": ("thickness", "height"),
}

Values: TypeAlias = Mapping[str, Sequence[Item]]
"""The items of an object's fields; a missing field, or one with items of a wrong type, has its default."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StandIn:
    """The description of a type: its fields, and the shapes that replace it.

    `kind` is "solid", "flat" for an object that lies on the ground, or "drawn" for an object that is only
    visible. Flat and drawn objects have no forms.
    """

    name: str
    fields: Mapping[str, ProtoField]
    kind: Literal["solid", "flat", "drawn"] = "solid"
    forms: tuple[Form, ...] = ()


def expand(stand_in: StandIn, values: Values) -> tuple[ShapePart, ...]:
    """Return the parts of an object of the type with these values of its fields."""

    def items(name: str) -> Sequence[float]:
        declared = stand_in.fields[name]
        default = _numbers(declared.default.items)
        given = _numbers(values.get(name, ()))
        several = declared.type.startswith("M")
        return given if given and (several or len(given) == len(default)) else default

    def points(name: str) -> list[Sequence[float]]:
        numbers = items(name)
        size = _AXES[stand_in.fields[name].type[2:]]
        return [numbers[at : at + size] for at in range(0, len(numbers) - size + 1, size)]

    return tuple(part for form in stand_in.forms for part in form.parts(items, points))


@cache
def shipped() -> Mapping[str, StandIn]:
    """Return the built-in stand-ins, by type."""
    return load_stand_ins(_SHIPPED.read_text(encoding="utf-8"), _SHIPPED.name)


def load_stand_ins(text: str, name: str) -> Mapping[str, StandIn]:
    """Return the stand-ins of the file with the content `text`, by type; `name` is its name in errors.

    Raises:
        StandInError: the file is not TOML, or an entry is wrong; the message has file, type, field, fact and
            remedy.
    """
    try:
        tables = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise StandInError(f"{name}: this is not TOML: {error}; correct it there") from None
    found: dict[str, StandIn] = {}
    for kind in _LISTS:
        for type_name in _listed(tables.pop(kind, []), f"{name}: {kind}"):
            found[type_name] = StandIn(name=type_name, fields=_standard(type_name), kind=kind)
    for type_name, table in tables.items():
        if type_name in found:
            raise StandInError(f"{name}: {type_name}: it is also in a list; keep one of the two")
        if not isinstance(table, dict):
            raise StandInError(f"{name}: {type_name}: this is not a table; write [{type_name}] and its shape")
        found[type_name] = _Entry(f"{name}: {type_name}", type_name, table).stand_in()
    return MappingProxyType(found)


def _listed(names: object, place: str) -> Iterator[str]:
    """Yield the types in the list `flat` or `drawn`."""
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise StandInError(f'{place}: this is not a list of types; write ["Carpet"], before the first table')
    yield from names


class _Entry:
    """One table of a file of stand-ins; errors begin with `place`, its position in the file."""

    def __init__(self, place: str, type_name: str, table: dict[str, Any]) -> None:
        self._place = place
        self._type = type_name
        self._table = table
        self._fields: dict[str, ProtoField] = {}

    def stand_in(self) -> StandIn:
        """Return the stand-in of this table."""
        rest = dict(self._table)
        self._fields = self._declared(rest.pop("fields", ""))
        kinds: list[Literal["flat", "drawn"]] = [kind for kind in _LISTS if rest.get(kind) is not None]
        if kinds:
            if rest != {kinds[0]: True}:
                self._refuse(
                    kinds[0],
                    "the type also has other keys, or the value is not true",
                    f"write {kinds[0]} = true alone",
                )
            return StandIn(name=self._type, fields=self._fields, kind=kinds[0])
        forms = self._parts(rest) if "parts" in rest else (self._form(rest, ""),)
        return StandIn(name=self._type, fields=self._fields, forms=forms)

    def _declared(self, text: object) -> dict[str, ProtoField]:
        """Return the fields that every object has, followed by the declared fields."""
        if not isinstance(text, str):
            self._refuse("fields", "this is not text", "declare fields as SFVec3f size 1 1 1, one per line")
        try:
            declared = parse_fields(text, self._type)
        except WorldError as error:
            self._refuse("fields", f"in its line {error.line}: {error.fact}", error.remedy)
        return {**_standard(self._type), **declared}

    def _parts(self, rest: dict[str, Any]) -> tuple[Form, ...]:
        parts = rest.pop("parts")
        if rest or not isinstance(parts, list) or not all(isinstance(part, dict) for part in parts):
            self._refuse(
                "parts",
                "it is not a list of tables, or the type has other keys",
                'write [ { box = "size" } ]',
            )
        return tuple(self._form(part, f"parts[{number}].") for number, part in enumerate(parts))

    def _form(self, table: dict[str, Any], prefix: str) -> Form:
        """Return the form of a table with one shape; `prefix` is its position in the entry, for errors."""
        shapes: list[FormKind] = [kind for kind in LENGTHS if table.get(kind) is not None]
        unknown = sorted(table.keys() - LENGTHS.keys() - _OPTIONS)
        if unknown:
            self._refuse(
                prefix + unknown[0],
                "it is not a key of a stand-in",
                f"choose from {_words({*LENGTHS, *_OPTIONS})}",
            )
        if len(shapes) != 1:
            fact = f"it has {len(shapes)} shapes"
            self._refuse(
                prefix.rstrip(".") or "shape", fact, f"write one of {_words(LENGTHS)}, flat, drawn or parts"
            )
        kind = shapes[0]
        path, closed = self._path(table[kind], prefix + kind) if kind == "wall" else ("", False)
        return Form(
            kind=kind,
            lengths=self._lengths(kind, table[kind], prefix + kind),
            at=self._three(table["at"], prefix + "at") if "at" in table else (),
            on_base=self._on_base(table.get("origin", "center"), prefix + "origin"),
            turn=self._optional(table, "turn", prefix),
            when=self._optional(table, "when", prefix),
            unless=self._optional(table, "unless", prefix),
            path=path,
            closed=closed,
        )

    def _lengths(self, kind: FormKind, written: object, place: str) -> tuple[Expression, ...]:
        """Return the lengths of a shape."""
        if kind in _FIELDS_OF_FORM:
            keys = _FIELDS_OF_FORM[kind]
            if not isinstance(written, dict) or not {*keys} <= written.keys() <= {*keys, "path", "closed"}:
                self._refuse(
                    place,
                    "it is not a table with the right keys",
                    f"write {{ {', '.join(f'{key} = 1' for key in keys)} }}",
                )
            return tuple(self._formula(written[key], f"{place}.{key}") for key in keys)
        if kind == "sphere":
            return (self._formula(written, place),)
        if kind == "box":
            return self._three(written, place)
        return self._vector(written, place, "xy")

    def _three(self, written: object, place: str) -> tuple[Expression, ...]:
        return self._vector(written, place, "xyz")

    def _vector(self, written: object, place: str, axes: str) -> tuple[Expression, ...]:
        """Return the formulas of a list of lengths, or of the name of a field with as many numbers."""
        if isinstance(written, str):
            written = [f"{written}.{axis}" for axis in axes]
        if not isinstance(written, list) or len(written) != len(axes):
            self._refuse(
                place, f"it does not have {len(axes)} lengths", "write them in a list, or the name of a field"
            )
        return tuple(self._formula(length, place) for length in written)

    def _path(self, written: object, place: str) -> tuple[str, bool]:
        """Return the field with the points of a wall, and whether the wall is closed."""
        path = str(written.get("path", "")) if isinstance(written, dict) else ""
        closed = written.get("closed", False) if isinstance(written, dict) else None
        declared = self._fields.get(path)
        if declared is None or declared.type not in ("MFVec2f", "MFVec3f") or not isinstance(closed, bool):
            fact = "its path is not a field with a list of points, or closed is not true or false"
            self._refuse(place, fact, 'declare MFVec3f path [ … ], and write path = "path"')
        return path, closed

    def _on_base(self, origin: object, place: str) -> bool:
        if origin not in ("center", "base"):
            self._refuse(
                place, f"{origin!r} is not an origin", 'write "center", or "base" for the lower side'
            )
        return origin == "base"

    def _optional(self, table: dict[str, Any], key: str, prefix: str) -> Expression | None:
        return self._formula(table[key], prefix + key) if key in table else None

    def _formula(self, written: object, place: str) -> Expression:
        """Return a formula; refuse it if a field in it is not declared, or lacks a number that it uses."""
        try:
            formula = parse_formula(written)
        except ValueError as error:
            fact, _, remedy = str(error).rpartition("; ")
            self._refuse(place, fact, remedy)
        for used in formula.names:
            self._check(used, place)
        return formula

    def _check(self, used: str, place: str) -> None:
        """Check that a field is declared and has the numbers that a formula uses."""
        summed = used.startswith("sum(")
        name, _, axis = used.removeprefix("sum(").removesuffix(")").partition(".")
        declared = self._fields.get(name)
        if declared is None:
            self._refuse(
                place, f"{self._type} has no field {name}", "declare it in fields, or write a number"
            )
        size = _AXES.get(declared.type[2:])
        fits = size is not None and (summed or (declared.type.startswith("S") and _has_axis(size, axis)))
        if not fits:
            self._refuse(
                place, f"{used} is not a number of {declared.type} {name}", "name one, such as size.x"
            )

    def _refuse(self, field: str, fact: str, remedy: str) -> NoReturn:
        raise StandInError(f"{self._place}: {field}: {fact}; {remedy}")


def _has_axis(size: int, axis: str) -> bool:
    return "xyz".find(axis) < size if axis else size == 0


def _words(names: Any) -> str:
    return ", ".join(sorted(names))


def _numbers(items: Sequence[Item]) -> Sequence[float]:
    """Return the items as numbers, TRUE as 1; () if an item is not a number."""
    if not all(isinstance(item, int | float) for item in items):
        return ()
    return tuple(float(item) for item in items if isinstance(item, int | float))


@cache
def _standard(type_name: str) -> Mapping[str, ProtoField]:
    """Return the fields that every object has; the default name is the type in lower case, as in Webots."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", type_name).lower()
    text = f'SFVec3f translation 0 0 0 SFRotation rotation 0 0 1 0 SFString name "{words}"'
    return MappingProxyType(parse_fields(text, type_name))
