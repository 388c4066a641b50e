"""Sensors over ROS: the services of each, and the feed that publishes its values once enabled."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from palaestra_sim.stub.catalogue import type_number
from palaestra_sim.stub.devices import (
    DistanceSensor,
    DistanceSensorType,
    Sensor,
    TouchSensor,
)
from palaestra_sim.stub.effects import UnsimulatedError
from palaestra_sim.stub.seam import Fields, Handler, Node, Publisher, Service, topic_name

_TOUCH_TABLE = [0.0, 0.0, 0.0, 5000.0, 50000.0, 0.0]  # the default of TouchSensor.lookupTable


@dataclass(slots=True, eq=False)
class Feed:
    """The topic of one sensor, by the rules of `enable`.

    A period that differs from those asked for adds a second publisher of the same topic, as in the
    controller; its messages and the first's come mixed. 0 takes them all back.

    Attributes:
        topic: below the robot's name; "" for the joystick, which the stub has not.
        sensor: anything with a `value`; None when there is never one.
        publishers: by period in ms.
    """

    topic: str
    type_name: str
    template: Fields
    sensor: Any
    publishers: dict[int, Publisher] = field(default_factory=dict)

    @property
    def period_ms(self) -> int:
        """The period that the sensor runs at; 0 when it is off."""
        return min(self.publishers, default=0)

    def enable(self, node: Node, period_ms: int, step_ms: int) -> bool:
        """Publish every `period_ms`, a multiple of the controller's step; 0 stops. False: refused.

        Raises:
            UnsimulatedError: it is a device that never says anything.
        """
        if period_ms == 0:
            for publisher in self.publishers.values():
                node.withdraw(publisher)
            self.publishers.clear()
            return True
        if not self.topic:
            raise UnsimulatedError("the stub has no joystick; use driver webots, or publish it yourself")
        if period_ms % step_ms:
            return False
        if period_ms not in self.publishers:
            self.publishers[period_ms] = node.advertise(self.topic, self.type_name, template=self.template)
        return True

    def publish(self, elapsed_ms: int) -> None:
        """Send the value to whoever is connected, if it is due."""
        sensor = self.sensor
        if sensor is None:
            return
        for period_ms, publisher in self.publishers.items():
            if elapsed_ms % period_ms == 0:
                publisher.send_value(sensor.value)


@dataclass(slots=True)
class _Battery:
    """The battery of a robot that has none."""

    value: float = -1.0


def sensor_feed(sensor: Sensor, node_name: str) -> Feed:
    """Return the feed of a sensor, not yet enabled."""
    path = topic_name(sensor.name)
    header = {"header": {"frame_id": f"{node_name}/{path}"}}
    if isinstance(sensor, DistanceSensor):
        low, high = sensor.table.limits
        constant = {
            **header,
            "radiation_type": int(sensor.type is DistanceSensorType.INFRA_RED),
            "field_of_view": sensor.aperture_rad,
            "min_range": low,
            "max_range": high,
        }
        return Feed(f"{path}/value", "sensor_msgs/Range", constant, sensor)
    type_name = "BoolStamped" if isinstance(sensor, TouchSensor) else "Float64Stamped"
    return Feed(f"{path}/value", f"webots_ros/{type_name}", header, sensor)


def pseudo_feeds(node_name: str) -> dict[str, Feed]:
    """Return the feeds of the devices that every robot has: nobody types, nothing is plugged in."""

    def header(name: str) -> Fields:
        return {"header": {"frame_id": f"{node_name}/{name}"}}

    return {
        "battery_sensor": Feed(
            "battery_sensor/value",
            "webots_ros/Float64Stamped",
            header("battery_sensor"),
            _Battery(),
        ),
        "keyboard": Feed("keyboard/key", "webots_ros/Int32Stamped", header("keyboard"), None),
        "joystick": Feed("", "", {}, None),
    }


def sensor_services(sensor: Sensor) -> tuple[Service, ...]:
    """Return what a sensor answers beside `enable` and `get_sampling_period`."""
    type_name = type(sensor).__name__
    rows: list[tuple[str, str, Handler]] = [
        ("get_model", "get_string", lambda _: {"value": sensor.model}),
        ("get_name", "get_string", lambda _: {"value": sensor.name}),
        ("get_node_type", "get_int", lambda _: {"value": type_number(type_name)}),
    ]
    if isinstance(sensor, DistanceSensor):
        low, high = sensor.table.limits
        table = [number for row in sensor.table.rows for number in row]
        rows += [
            ("get_min_value", "get_float", lambda _: {"value": low}),
            ("get_max_value", "get_float", lambda _: {"value": high}),
            ("get_aperture", "get_float", lambda _: {"value": sensor.aperture_rad}),
            ("get_lookup_table", "get_float_array", lambda _: {"value": table}),
            ("get_type", "get_int", lambda _: {"value": int(sensor.type)}),
        ]
    elif isinstance(sensor, TouchSensor):
        rows += [
            ("get_type", "get_int", lambda _: {"value": int(sensor.type)}),
            ("get_lookup_table", "get_float_array", lambda _: {"value": _TOUCH_TABLE}),
        ]
    path = topic_name(sensor.name)
    return tuple(Service(f"{path}/{name}", f"webots_ros/{kind}", do) for name, kind, do in rows)
