"""The radio between emitters and receivers: it selects the receivers that get a packet."""

from __future__ import annotations

import math
from collections.abc import Iterable

from palaestra_sim.scene.devices.emitter import EVERYWHERE, Emitter
from palaestra_sim.scene.devices.receiver import Packet, Receiver
from palaestra_sim.scene.geometry import transposed, turn


class Radio:
    """Delivers packets from the emitters of each robot to the receivers of all other robots.

    Args:
        robots: for each robot, its devices; only emitters and receivers among them are used.
    """

    def __init__(self, robots: Iterable[Iterable[object]]) -> None:
        devices = tuple((number, it) for number, robot in enumerate(robots) for it in robot)
        self._emitters = tuple((number, it) for number, it in devices if isinstance(it, Emitter))
        self._receivers = tuple((number, it) for number, it in devices if isinstance(it, Receiver))

    def deliver(self) -> None:
        """Deliver the packets that were sent since the last call."""
        for robot, emitter in self._emitters:
            if emitter.outbox:
                for other, receiver in self._receivers:
                    if other != robot:
                        _carry(emitter, receiver)
                emitter.outbox.clear()

    def clear(self) -> None:
        """Drop all packets that are on their way or have not been read."""
        for _, emitter in self._emitters:
            emitter.outbox.clear()
        for _, receiver in self._receivers:
            receiver.queue.clear()


def _carry(emitter: Emitter, receiver: Receiver) -> None:
    if not receiver.listening:
        return
    pose = receiver.place.world_pose
    source = emitter.place.world_position
    offset = tuple(a - b for a, b in zip(source, pose.position, strict=True))
    distance_m = math.hypot(*offset)
    unit = tuple(part / distance_m for part in offset) if distance_m else (0.0, 0.0, 0.0)
    direction = turn(transposed(pose.rotation), (unit[0], unit[1], unit[2]))
    strength = 1.0 / distance_m**2 if distance_m else math.inf
    for text, channel, range_m in emitter.outbox:
        tuned = EVERYWHERE in (channel, receiver.channel) or channel == receiver.channel
        if tuned and (range_m == EVERYWHERE or distance_m <= range_m):
            receiver.take(Packet(text, strength, direction))
