"""Radars: the targets of the last step."""

from __future__ import annotations

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.webots.devices.calls import DeviceCalls, Reading, elements, facts, served


def radar(calls: DeviceCalls) -> ServedDevice:
    """Return a Radar; each target is one message."""
    limits = ("get_min_range", "get_max_range", "get_vertical_fov", "get_horizontal_fov")
    targets = DeviceTopic(
        name="targets",
        type_name="webots_ros/RadarTarget",
        source=Reading(lambda: _targets(calls)),
        many=True,
        whole=True,
    )
    count = DeviceTopic(
        name="number_of_targets",
        type_name="webots_ros/Int8Stamped",
        source=Reading(calls.get_number_of_targets),
    )
    return served(calls, topics=(targets, count), rows=facts(calls, "get_float", *limits))


def _targets(calls: DeviceCalls) -> list[Fields]:
    return [
        {
            "distance": target.distance,
            "receivedPower": target.received_power,
            "speed": target.speed,
            "azimuth": target.azimuth,
        }
        for target in elements(calls.get_targets(), calls.get_number_of_targets())
    ]
