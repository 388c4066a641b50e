"""The simple shapes that replace an object: boxes, cylinders, spheres and planes in the object's frame.

A Form describes one shape of a stand-in by formulas. With the fields of an object, the Form becomes
ShapeParts, whose sizes are numbers. A wall along a path, or in a ring, becomes a box for each straight piece.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, TypeAlias

from palaestra_sim.world.expressions import Expression, Numbers

Shape: TypeAlias = Literal["box", "cylinder", "sphere", "plane"]
FormKind: TypeAlias = Literal["box", "cylinder", "sphere", "plane", "ring", "wall"]

LENGTHS: dict[FormKind, int] = {"box": 3, "cylinder": 2, "sphere": 1, "plane": 2, "ring": 3, "wall": 2}
"""The number of lengths of each form; see `Form`."""

_PIECES_OF_RING = 24


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapePart:
    """One shape, in the frame of its object; lengths in meters, the turn about z in radians.

    The size of a box is (x, y, z), of an upright cylinder (radius, height), of a sphere (radius,), of a plane
    (x, y). `position` is the center.
    """

    shape: Shape
    size: tuple[float, ...]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A shape whose lengths are formulas.

    A box, cylinder, sphere or plane has the same lengths as its ShapePart. The lengths of a ring are (inner
    radius, thickness, height), and those of a wall (thickness, height). A wall follows the points of the
    field `path`, and returns to the first point if `closed`. `at` is the center of the form, or, if
    `on_base`, and for every ring and wall, the center of the lower side. The object has the form only if
    `when` is not 0 and `unless` is 0.
    """

    kind: FormKind
    lengths: tuple[Expression, ...]
    at: tuple[Expression, ...] = ()
    on_base: bool = False
    turn: Expression | None = None
    when: Expression | None = None
    unless: Expression | None = None
    path: str = ""
    closed: bool = False

    def parts(
        self, numbers: Numbers, points: Callable[[str], Sequence[Sequence[float]]]
    ) -> Iterator[ShapePart]:
        """Yield the parts of an object; a form with a length that is not positive has no parts.

        `numbers` returns the numbers of a field, and `points` returns the vectors of a field that is a list.
        """
        if self.when is not None and not self.when.value(numbers):
            return
        if self.unless is not None and self.unless.value(numbers):
            return
        lengths = tuple(length.value(numbers) for length in self.lengths)
        if not all(length > 0 and math.isfinite(length) for length in lengths):
            return
        x, y, z = (formula.value(numbers) for formula in self.at) if self.at else (0.0, 0.0, 0.0)
        turn = self.turn.value(numbers) if self.turn is not None else 0.0
        if self.kind == "ring":
            yield from _along(_circle(lengths[0] + lengths[1] / 2), lengths[1:], (x, y, z))
        elif self.kind == "wall":
            path = [(*point[:2], *(point[2:] or (0.0,))) for point in points(self.path)]
            yield from _along([*path, *path[: int(self.closed)]], lengths, (x, y, z))
        else:
            raised = z + _height(self.kind, lengths) / 2 if self.on_base else z
            yield ShapePart(shape=self.kind, size=lengths, position=(x, y, raised), turn=turn)


def _along(
    path: Sequence[Sequence[float]], lengths: Sequence[float], at: tuple[float, float, float]
) -> Iterator[ShapePart]:
    """Yield a box for each piece of a path on the ground; `lengths` are thickness and height."""
    thickness, height = lengths
    for start, end in pairwise(path):
        dx, dy = end[0] - start[0], end[1] - start[1]
        middle = [(a + b) / 2 + offset for a, b, offset in zip(start, end, at, strict=True)]
        yield ShapePart(
            shape="box",
            size=(math.hypot(dx, dy) + thickness, thickness, height),
            position=(middle[0], middle[1], middle[2] + height / 2),
            turn=math.atan2(dy, dx),
        )


def _circle(radius: float) -> list[tuple[float, float, float]]:
    """Return the corners of a closed ring."""
    angles = [2 * math.pi * piece / _PIECES_OF_RING for piece in range(_PIECES_OF_RING + 1)]
    return [(radius * math.cos(angle), radius * math.sin(angle), 0.0) for angle in angles]


def _height(shape: Shape, lengths: Sequence[float]) -> float:
    match shape:
        case "sphere":
            return 2 * lengths[0]
        case "plane":
            return 0.0
        case _:
            return lengths[-1]
