"""Emitters and receivers."""

from __future__ import annotations

import ctypes
from typing import Any

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.webots.devices.calls import DeviceCalls, Reading, commands, facts, served


def emitter(calls: DeviceCalls) -> ServedDevice:
    """Return an Emitter."""

    def send(request: Any) -> Fields:
        packet = request.value.encode()
        calls.send(packet, len(packet))
        return {"success": True}

    rows = (
        ("send", "set_string", send),
        *facts(calls, "get_int", "get_buffer_size", "get_channel"),
        *facts(calls, "get_float", "get_range"),
        *commands(calls, "set_int", "set_channel"),
        *commands(calls, "set_float", "set_range"),
    )
    return served(calls, rows=rows)


def receiver(calls: DeviceCalls) -> ServedDevice:
    """Return a Receiver; its topic repeats the first packet of the queue until `next_packet`."""
    data = DeviceTopic(
        name="data",
        type_name="webots_ros/StringStamped",
        source=Reading(lambda: _packet(calls)),
        reading="data",
    )
    return served(calls, topics=(data,), rows=(*_queue(calls),))


def _queue(calls: DeviceCalls) -> tuple[Row, ...]:
    def waiting() -> bool:
        return bool(calls.get_queue_length() > 0)

    def next_packet(_request: Any) -> Fields:
        if not waiting():
            return {"value": False}
        calls.next_packet()
        return {"value": True}

    def direction(_request: Any) -> Fields:
        return {"direction": list(calls.get_emitter_direction() if waiting() else (0.0, 0.0, 0.0))}

    return (
        *commands(calls, "set_int", "set_channel"),
        *facts(calls, "get_int", "get_channel", "get_queue_length"),
        ("next_packet", "get_bool", next_packet),
        ("get_data_size", "get_int", lambda _: {"value": calls.get_data_size() if waiting() else -1}),
        (
            "get_signal_strength",
            "get_float",
            lambda _: {"value": calls.get_signal_strength() if waiting() else -1.0},
        ),
        ("get_emitter_direction", "receiver_get_emitter_direction", direction),
    )


def _packet(calls: DeviceCalls) -> str:
    """Return the first packet as text; as in Webots' controller, it ends at the first byte 0."""
    if calls.get_queue_length() <= 0:
        return ""
    packet = ctypes.string_at(calls.get_data(), calls.get_data_size())
    return packet.partition(b"\0")[0].decode(errors="replace")
