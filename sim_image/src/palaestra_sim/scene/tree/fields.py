"""Fields of nodes: typed values that a supervisor reads and writes.

A read returns the written value at once, but the simulation applies the value at the beginning of the next
basic step. A write of `translation` or `rotation` moves an object, and a write of `customData` reaches the
robot. A write that only changes the look of an object is accepted too, because the motion does not depend on
the look. `write_rules` refuses a write that would not have the effect that it has in Webots. Otherwise the
client would read the value back although nothing had changed.

As in Webots, a value that is invalid for the field is ignored without an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

from palaestra_sim.errors import SimError
from palaestra_sim.scene.geometry import AxisAngle
from palaestra_sim.scene.joints import JointFrame
from palaestra_sim.scene.nodes.scene_node import FieldContent, SceneNode
from palaestra_sim.scene.tree.field_types import WIDTH, FieldKind, FieldType
from palaestra_sim.scene.tree.write_rules import require_admitted, require_effect


class NoValueError(SimError, LookupError):
    """A field has no value of that type at that index; Webots would read a null pointer."""


class Changes(Protocol):
    """The simulation, which receives the writes of fields."""

    def before_next_step(self, change: Callable[[], None], /) -> None:
        """Call `change` at the beginning of the next basic step."""
        ...

    def changed(self, node: SceneNode, field: str, /) -> None:
        """Apply the effect of a field that has a new value."""
        ...


class NodeField:
    """One field of one node.

    Attributes:
        node: the node that has the field.
        name: the name of the field in the world file.
        kind: the declaration of the field.
    """

    def __init__(self, node: SceneNode, name: str, kind: FieldKind, changes: Changes) -> None:
        self.node = node
        self.name = name
        self.kind = kind
        self._changes = changes
        self._read = node.fields.get(name)  # the content from which `_values` was made
        self._values = _initial(node, name, kind)
        self._writes = 0  # pending writes, which the simulation has not yet applied

    @property
    def count(self) -> int:
        """Return the number of values, like `get_count`: -1 for a field with exactly one value."""
        return len(self._current()) if self.kind.multiple else -1

    def get(self, type_: FieldType, index: int = 0) -> Any:
        """Return the value at `index`; for a field with exactly one value, `index` is ignored.

        The value is a bool, int, float, str, a tuple of floats, or for `NODE` a SceneNode or None.

        Raises:
            NoValueError: the field has another type, or no value at that index.
        """
        values = self._current()
        at = index if self.kind.multiple else 0
        if type_ is not self.kind.type or not -len(values) <= at < len(values):
            raise NoValueError(f"{self.name} ({self.kind.name}) has no {type_.name} at {index}")
        return values[at]

    def set(self, type_: FieldType, index: int, value: Any) -> None:
        """Write a value, which takes effect at the next basic step; a read returns it at once.

        Raises:
            UnsimulatedError: the write would have no effect, or the node cannot have that value.
        """
        at = index if self.kind.multiple else 0
        if type_ is not self.kind.type or not _acceptable(type_, value):
            return
        values = list(self._current())
        if not -len(values) <= at < len(values):
            return
        if self.node.outline and not _positive(value):
            return
        self._require_effect()
        require_admitted(self.node, self.name, value)
        values[at] = value
        self._write(values)

    def room(self, index: int) -> int | None:
        """Return the position for a node inserted at `index` (-1: the end); None if that is impossible."""
        size = len(self._current())
        if self.kind.type is not FieldType.NODE:
            return None
        if not self.kind.multiple:
            return 0 if self._current() == [None] else None
        return (index if index >= 0 else size + 1 + index) if -size - 1 <= index <= size else None

    def insert(self, type_: FieldType, index: int, value: Any) -> bool:
        """Insert a value before `index`, or at the end for -1; return False if that is impossible.

        Raises:
            UnsimulatedError: the inserted value would have no effect.
        """
        values = list(self._current())
        size = len(values)
        fits = self.kind.multiple and type_ is self.kind.type and -size - 1 <= index <= size
        if not fits or not _acceptable(type_, value):
            return False
        self._require_effect()
        values.insert(index if index >= 0 else size + 1 + index, value)
        self._write(values)
        return True

    def remove(self, index: int) -> bool:
        """Remove the value at `index`; return False if the value does not exist, or cannot be removed.

        Raises:
            UnsimulatedError: the removal would have no effect.
        """
        values = list(self._current())
        size = len(values)
        removable = self.kind.multiple and self.kind.type is not FieldType.NODE
        if not removable or not -size <= index < size:
            return False
        self._require_effect()
        del values[index]
        self._write(values)
        return True

    def _write(self, values: list[Any]) -> None:
        """Set the values for reads from now on, and for the simulation at the next basic step."""
        self._values = values
        self._writes += 1
        self._changes.before_next_step(self._take_effect)

    def _require_effect(self) -> None:
        require_effect(self.node, self.name)

    def _current(self) -> list[Any]:
        """Return the values of the pending writes; without pending writes, the values of the simulation."""
        if self.kind.type is FieldType.NODE:
            return _initial(self.node, self.name, self.kind)
        if self._writes == 0:
            if (live := _live(self.node, self.name)) is not None:
                return live
            written = self.node.fields.get(self.name)
            if written is not self._read:  # another NodeField of the node, or of its twin, was written
                self._read, self._values = written, _initial(self.node, self.name, self.kind)
        return self._values

    def _take_effect(self) -> None:
        """Pass the written values to the simulation; of several pending writes, only the last one counts."""
        self._writes -= 1
        if self._writes == 0:
            for twin in self.node.twins:
                twin.fields[self.name] = FieldContent(_flat(self._values), bracketed=self.kind.multiple)
                self._changes.changed(twin, self.name)


def _live(node: SceneNode, name: str) -> list[Any] | None:
    """Return the values of a field that changes by itself; None for any other field."""
    place = node.place
    match name:
        case "translation" if place is not None:
            return [place.translation]
        case "rotation" if place is not None:
            return [place.rotation]
        case "customData":
            return [node.text("customData") or ""]
        case "battery":
            return list(node.numbers("battery") or ())
        case "position" if (end := _end_of(node)) is not None:
            return [end.joint.now]
    return None


def _end_of(node: SceneNode) -> JointFrame | None:
    """Return the end of the joint whose first `jointParameters` are `node`."""
    joint = node.parent
    if joint is None or node not in joint.nodes("jointParameters"):
        return None
    places = (end.place for end in joint.nodes("endPoint"))
    return next((place for place in places if isinstance(place, JointFrame)), None)


def quaternion_to_axis_angle(x: float, y: float, z: float, w: float) -> AxisAngle:
    """Return the axis and angle that Webots' controller computes from a quaternion, including a bug.

    The controller's RosMathUtils set an angle below 1e-4 to 0, but still compute the axis as xyz / |xyz|. For
    the exact identity this axis is NaN, so a client cannot write back a zero rotation that it has read. If
    |w| > 1, the angle is NaN.
    """
    angle_rad = 2.0 * math.acos(w) if -1.0 <= w <= 1.0 else math.nan
    if angle_rad < 1e-4:  # noqa: PLR2004 - Source: RosMathUtils
        angle_rad = 0.0
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        return math.nan, math.nan, math.nan, angle_rad
    return x / length, y / length, z / length, angle_rad


def _acceptable(type_: FieldType, value: Any) -> bool:
    """Return whether libController accepts a value: finite numbers, and a rotation axis that is not 0."""
    if type_ is FieldType.ROTATION and not any(value[:3]):
        return False
    if isinstance(value, tuple):
        return all(map(math.isfinite, value))
    return type_ is not FieldType.FLOAT or math.isfinite(value)


def _positive(value: Any) -> bool:
    """Return whether all numbers of a size are positive, as Webots requires."""
    numbers: tuple[float, ...] = value if isinstance(value, tuple) else (value,)
    return min(numbers) > 0.0


def _initial(node: SceneNode, name: str, kind: FieldKind) -> list[Any]:
    """Return the values in the world file, or the default."""
    written = node.fields.get(name)
    if kind.type is FieldType.NODE:
        inside: list[Any] = [] if written is None else list(written.items)
        return inside if kind.multiple or inside else [None]
    items = list(written.items) if written is not None else _default(kind)
    width = WIDTH.get(kind.type, 1)
    if width > 1:
        return [tuple(items[at : at + width]) for at in range(0, len(items) - width + 1, width)]
    return [_scalar(kind.type, item) for item in items]


def _default(kind: FieldKind) -> list[Any]:
    if kind.type is FieldType.STRING:
        return [] if kind.multiple and not kind.default else [kind.default]
    if kind.type is FieldType.BOOL:
        return [kind.default == "TRUE"]
    return [float(word) for word in kind.default.split()]


def _flat(values: list[Any]) -> list[Any]:
    """Return the values in the form of a world file: a vector as its numbers, every number a float."""
    items: list[Any] = []
    for value in values:
        items += value if isinstance(value, tuple) else [value]
    return [float(item) if type(item) is int else item for item in items]


def _scalar(type_: FieldType, item: Any) -> Any:
    return int(item) if type_ is FieldType.INT32 else item
