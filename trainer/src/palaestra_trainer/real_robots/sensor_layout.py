"""How a robot reports its distance sensors, which differs between robots and connections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import SENSOR_RANGE_M
from palaestra_trainer.robots.infrared import meters

ORDERS: Final = ("counter-clockwise", "clockwise")
UNITS: Final = ("meters", "volts")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLayout:
    """How a robot reports its nine distance sensors.

    Attributes:
        order: the order of the sensors after the one that points forward, one of `ORDERS`.
        unit: the unit of their values, one of `UNITS`; volts are the output of the sensor GP2Y0A41.

    Raises:
        ConfigurationError: a value is not one of these.
    """

    order: str = ORDERS[0]
    unit: str = UNITS[0]

    def __post_init__(self) -> None:
        """Check both values."""
        for name, value, known in (("order", self.order, ORDERS), ("unit", self.unit, UNITS)):
            if value not in known:
                raise ConfigurationError(f"sensors: {name} {value!r} is not known; use {' or '.join(known)}")

    def meters_of(self, values: list[float]) -> NDArray[np.float32]:
        """Return meters within the range of the sensors, shape (9,), counter-clockwise from forward."""
        in_meters = values if self.unit == UNITS[0] else [meters(value) for value in values]
        ordered = in_meters if self.order == ORDERS[0] else [in_meters[0], *in_meters[:0:-1]]
        return np.clip(np.array(ordered, np.float32), *np.array(SENSOR_RANGE_M, np.float32))
