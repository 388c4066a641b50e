"""The three types of touch sensors: a bumper, the pressure on a sensor, and the force on it."""

from __future__ import annotations

from typing import ClassVar, Final

from palaestra_trainer.errors import WorldMisfit
from palaestra_trainer.webots.device import lookup_table_fact, named
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.message_decoding import BOOL, FLOAT64, NumberReading, PickedReading

_TYPES: Final = ("bumper", "force", "force-3d")  # by number. Source: webots/touch_sensor.h
_WRENCH: Final = "6d"  # geometry_msgs/WrenchStamped: force and torque


class _TouchSensor(NodeSensor):
    """A TouchSensor of one type; a sensor of another type publishes other messages."""

    __slots__ = ()
    lookup_table = lookup_table_fact()
    nodes = ("TouchSensor",)
    sensor_type = named(
        "get_type", _TYPES, 'The type of the sensor in the world: "bumper", "force" or "force-3d".'
    )
    reads: ClassVar[str]

    def enable(self, period_ms: int) -> None:
        """Make the sensor publish every `period_ms` of simulated time, and subscribe to its topic.

        Raises:
            WorldMisfit: the sensor has another type in the world.
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        found = self.sensor_type
        if found != self.reads:
            misfit = WorldMisfit(
                self.robot,
                f'{self.device} has the type "{found}", which {_CLASSES.get(found, "no class")} reads; use'
                f' that class, or set the type "{self.reads}" in the world',
            )
            raise self.explained(misfit)
        super().enable(period_ms)


class TouchSensor(_TouchSensor):
    """A bumper; `value` is True while an object touches it."""

    __slots__ = ()
    reads = "bumper"

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/BoolStamped", NumberReading(device, BOOL))


class ForceSensor(_TouchSensor):
    """A TouchSensor of type `force`; `value` is the output of its lookup table for the pressure along x.

    With an empty table, `value` is the pressure in N.
    """

    __slots__ = ()
    reads = "force"

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/Float64Stamped", NumberReading(device, FLOAT64))


class Force3DSensor(_TouchSensor):
    """A TouchSensor of type `force-3d`; `value` is the output of its lookup table for x, y and z.

    With an empty table, `value` is the force in N along the axes of the sensor.
    """

    __slots__ = ()
    reads = "force-3d"

    def __init__(self, robot: str, device: str) -> None:
        reading = PickedReading(device, _WRENCH, (0, 1, 2))
        super().__init__(robot, device, "geometry_msgs/WrenchStamped", reading, "values")


_CLASSES: Final = {kind.reads: kind.__name__ for kind in (TouchSensor, ForceSensor, Force3DSensor)}
