"""The response of a sensor to its measurement: resolution, lookup table, and the axes of a vector."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import DevicePart
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.lookup_table import LookupTable, lookup_table
from palaestra_sim.scene.lookup_table import Row as TableRow

Gauss = Callable[[float, float], float]

# The fields of a sensor with three axes, besides `name` and the fields of a Solid.
AXES_FIELDS = """lookupTable MFVec3f; xAxis SFBool TRUE; yAxis SFBool TRUE; zAxis SFBool TRUE;
    resolution SFFloat -1"""


def discrete(value: float, resolution: float) -> float:
    """Return the multiple of the resolution nearest to the value; with resolution -1, the value itself."""
    return resolution * round(value / resolution) if resolution > 0.0 else value


def table_rows(part: DevicePart, default: Sequence[TableRow] = (), first: str = "inputs") -> list[TableRow]:
    """Return the lookup table, by increasing input; `first` names the first column of the rows in errors."""
    if "lookupTable" not in part.node.fields:
        return list(default)
    numbers = part.node.numbers("lookupTable")
    if numbers is None or len(numbers) % 3:
        part.refuse("lookupTable does not have rows of three numbers", f"write {first[:-1]}, value, noise")
        return []
    rows = list(zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True))
    if any(after[0] <= before[0] for before, after in pairwise(rows)):
        part.refuse(f"the {first} of lookupTable do not increase", "sort its rows")
        return []
    return rows


@dataclass(slots=True, kw_only=True, eq=False)
class Axes:
    """The response of a sensor with three axes.

    Attributes:
        table: the lookup table for each axis; None leaves the values unchanged.
        on: whether x, y and z are measured; if not, the value is NaN.
        resolution: the resolution of each value; -1 for exact values.
    """

    table: LookupTable | None
    on: tuple[bool, bool, bool]
    resolution: float

    def respond(self, measured: Vector, gauss: Gauss) -> Vector:
        """Return the values of the axes; noise of the table is drawn from `gauss(mean, deviation)`."""
        x, y, z = (
            self._value(value, gauss) if on else math.nan for value, on in zip(measured, self.on, strict=True)
        )
        return x, y, z

    def services(self) -> tuple[Row, ...]:
        """Return the service of the lookup table."""
        rows = () if self.table is None else self.table.rows
        return table_service(rows)

    def _value(self, value: float, gauss: Gauss) -> float:
        if self.table is not None:
            value = self.table.response(value, gauss)
        return discrete(value, self.resolution)


def read_axes(part: DevicePart) -> Axes:
    """Return the response of a sensor with three axes."""
    rows = table_rows(part)
    flag = part.node.flag
    return Axes(
        table=lookup_table(*rows) if rows else None,
        on=(flag("xAxis", default=True), flag("yAxis", default=True), flag("zAxis", default=True)),
        resolution=part.number("resolution", -1.0),
    )


def table_service(rows: Sequence[TableRow]) -> tuple[Row, ...]:
    """Return the service that returns a lookup table."""
    table = [number for row in rows for number in row]
    return (("get_lookup_table", "get_float_array", lambda _: {"value": table}),)
