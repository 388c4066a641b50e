"""Connector: detects whether another connector is near enough to connect.

If another connector is near enough, `lock` fails, because joining is not simulated. Connectors fit if they
face each other; the x axis of each points outward. Source: WbConnector.cpp of Webots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row, UnsimulatedError
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, DeviceType
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.old_axes import pointing

_PASSIVE: Final = -1  # value of `presence` for a passive connector, which cannot detect other connectors
_MATCHING: Final = {"symmetric": "symmetric", "active": "passive", "passive": "active"}


@dataclass(slots=True, kw_only=True, eq=False)
class Connector:
    """A connector.

    Attributes:
        kind: "symmetric", "active" or "passive".
        reach_m: maximum distance to another connector.
        tilt_rad: maximum angle between the axes of two connectors.
        turns: number of rotations about the axis at which two connectors fit; 0 means any rotation.
        twist_rad: maximum deviation from one of these rotations.
        others: all connectors of the world, including this connector.
        locked: the state that a client set.
    """

    name: str
    model: str
    place: Frame
    kind: str
    reach_m: float
    tilt_rad: float
    turns: int
    twist_rad: float
    locked: bool
    others: tuple[Connector, ...] = field(default=(), repr=False)

    @property
    def value(self) -> int:
        """1 if another connector is in reach, 0 if not, -1 for a passive connector."""
        if self.kind == "passive":
            return _PASSIVE
        return int(any(self._fits(other) for other in self.others if other is not self))

    def lock(self, *, locked: bool) -> None:
        """Lock or unlock the connector.

        Raises:
            UnsimulatedError: the lock would join the connector to another connector.
        """
        if locked and self.value > 0:
            raise UnsimulatedError(
                f"{self.name} and another Connector are in reach, but joining them is not simulated;"
                " use driver webots"
            )
        self.locked = locked

    def _fits(self, other: Connector) -> bool:
        if other.model != self.model or other.kind != _MATCHING[self.kind]:
            return False
        mine, theirs = self.place.world_pose, other.place.world_pose
        if math.dist(mine.position, theirs.position) > self.reach_m:
            return False
        tilt_rad = math.pi - _angle(_axis(mine, 0), _axis(theirs, 0))
        return tilt_rad <= self.tilt_rad and self._turned_right(_angle(_axis(mine, 2), _axis(theirs, 2)))

    def _turned_right(self, twist_rad: float) -> bool:
        if self.turns == 0:
            return True
        step_rad = 2.0 * math.pi / self.turns
        return abs(twist_rad - step_rad * round(twist_rad / step_rad)) <= self.twist_rad


def _axis(pose: Pose, index: int) -> Vector:
    rotation = pose.rotation
    return rotation[index], rotation[3 + index], rotation[6 + index]


def _angle(a: Vector, b: Vector) -> float:
    cosine = sum(left * right for left, right in zip(a, b, strict=True))
    return math.acos(max(-1.0, min(1.0, cosine)))


def _read(part: DevicePart) -> Connector:
    kind = part.text("type", "symmetric")
    if kind not in _MATCHING:
        part.refuse(f"{kind!r} is not a type of connector", f"use {', '.join(_MATCHING)}")
        kind = "symmetric"
    return Connector(
        name=part.name,
        model=part.text("model"),
        place=pointing(part.node, part.place),
        kind=kind,
        reach_m=part.number("distanceTolerance", 0.01),
        tilt_rad=part.number("axisTolerance", 0.2),
        turns=int(part.number("numberOfRotations", 4.0)),
        twist_rad=part.number("rotationTolerance", 0.5),
        locked=part.node.flag("isLocked", False),
    )


def _services(connector: Connector) -> tuple[Row, ...]:
    def lock(request: Any) -> Fields:
        connector.lock(locked=request.value)
        return {"success": True}

    return (("lock", "set_bool", lock), ("is_locked", "get_bool", lambda _: {"value": connector.locked}))


def _topics(connector: Connector) -> tuple[DeviceTopic, ...]:
    return (DeviceTopic(name="presence", type_name="webots_ros/Int8Stamped", source=connector),)


CONNECTOR: Final = DeviceType(
    node="Connector",
    name="connector",
    without_effect="autoLock unilateralLock unilateralUnlock snap tensileStrength shearStrength",
    fields="""type SFString symmetric; isLocked SFBool FALSE; autoLock SFBool FALSE;
        unilateralLock SFBool TRUE; unilateralUnlock SFBool TRUE; distanceTolerance SFFloat 0.01;
        axisTolerance SFFloat 0.2; rotationTolerance SFFloat 0.5; numberOfRotations SFInt32 4;
        snap SFBool TRUE; tensileStrength SFFloat -1; shearStrength SFFloat -1""",
    read=_read,
    services=_services,
    topics=_topics,
    sensor="presence_sensor",
)
