"""The lights of a world, and the irradiance at a sensor. Pure.

A light's fields are read at each measurement, because a supervisor may change them. As in Webots, the
direction of a light is in the axes of the world, but its location is in the frame of the node that contains
it. Source: reference/lightsensor.md and WbLightSensor.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.geometry import Pose, Vector, dot, minus
from palaestra_sim.scene.nodes.scene_node import SceneNode

_BACKGROUND: Final = "TexturedBackgroundLight"
_LIGHTS: Final = frozenset(("DirectionalLight", "PointLight", "SpotLight", _BACKGROUND))
# PROTOs of Webots that contain lights. Their stand-ins have no lights.
_LAMPS: Final = frozenset(
    (
        "CeilingLight",
        "CeilingSpotLight",
        "ConstructionLamp",
        "ControlledStreetLight",
        "DoubleFluorescentLamp",
        "FloorLight",
        "StreetLight",
    )
)
_MOUNTAINS: Final = "mountains"
_FROM_MOUNTAINS: Final = (0.55, -0.6, -1.0)  # direction of the light of "mountains": east, north, up
_OF_MOUNTAINS, _AMBIENT_OF_MOUNTAINS = 2.7, 1.0  # intensities of the direct and the ambient light
_EVERYWHERE: Final = (1.0, 0.0, 0.0)  # an attenuation that does not depend on the distance
_FAR_M: Final = 1000.0  # the length of a ray to a light without location, in Webots
_LEAST: Final = 1e-300  # divisor instead of an attenuation of 0; the lookup table limits the quotient
_WIDEST_RAD: Final = 0.785398  # the default of SpotLight.cutOffAngle
_BEAM_RAD: Final = 1.570796

Lit = Callable[[Vector], bool]
"""Gets the way from a sensor to a light, in meters, in the world's axes; returns whether the way is free."""


@dataclass(frozen=True, slots=True)
class Light:
    """A light of the world.

    Attributes:
        node: the node of the light.
        axes: the axes of the world that point east, north and up, 0 to 2.
    """

    node: SceneNode
    axes: tuple[int, int, int]

    def irradiance(self, sensor: Pose, shares: Vector, lit: Lit) -> float:
        """Return the irradiance in W/m2 at a sensor that looks along x.

        Args:
            sensor: the pose of the sensor, in the axes of the world.
            shares: the fractions of red, green and blue light that the sensor measures.
            lit: decides whether the direct light reaches the sensor; called only if there is direct light.
        """
        if not self.node.flag("on", True):
            return 0.0
        ambient, direct, way = self._white(sensor.position, sensor.turned((1.0, 0.0, 0.0)))
        white = ambient + direct if direct > 0.0 and lit(way) else ambient
        return white * dot(shares, _vector(self.node, "color", (1.0, 1.0, 1.0))) / 3.0

    def _white(self, at: Vector, normal: Vector) -> tuple[float, float, Vector]:
        """Return the ambient and the direct irradiance of a white light, and the way to it, in meters."""
        node = self.node
        if node.type_name == _BACKGROUND:
            way = _far(_opposite(self._from_mountains()))
            direct = _OF_MOUNTAINS * _number(node, "luminosity", 1.0) * _cosine(normal, way)
            return _AMBIENT_OF_MOUNTAINS, direct, way
        ambient, intensity = _number(node, "ambientIntensity", 0.0), _number(node, "intensity", 1.0)
        direction = _vector(node, "direction", (0.0, 0.0, -1.0))
        if node.type_name == "DirectionalLight":
            way = _far(_opposite(direction))
            return ambient, intensity * _cosine(normal, way), way
        way = minus(self._location(), at)
        far_m = math.hypot(*way)
        a, b, c = attenuation = _vector(node, "attenuation", _EVERYWHERE)
        weakened = a + b * far_m + c * far_m**2
        if attenuation != _EVERYWHERE:
            ambient = 0.0
        if node.type_name == "SpotLight":
            intensity *= self._share_of_beam(_cosine(way, _opposite(direction)))
        weakened = max(weakened, _LEAST)
        return ambient / weakened, intensity * _cosine(normal, way) / weakened, way

    def _from_mountains(self) -> Vector:
        direction = [0.0, 0.0, 0.0]
        for axis, value in zip(self.axes, _FROM_MOUNTAINS, strict=True):
            direction[axis] = value
        return direction[0], direction[1], direction[2]

    def _location(self) -> Vector:
        location = _vector(self.node, "location", (0.0, 0.0, 0.0))
        around = next((it.place for it in self.node.ancestors() if it.place is not None), None)
        return location if around is None else around.world_pose.carry(location)

    def _share_of_beam(self, cosine: float) -> float:
        """Return the share of a spot's light at an angle to its axis, given the cosine of the angle."""
        off = math.acos(min(1.0, cosine))
        widest = _number(self.node, "cutOffAngle", _WIDEST_RAD)
        beam = min(_number(self.node, "beamWidth", _BEAM_RAD), widest)
        if off > widest:
            return 0.0
        return 1.0 if off <= beam else (off - widest) / (beam - widest)


def lights_in(root: SceneNode) -> Iterator[SceneNode]:
    """Yield the lights of a world, except those inside the PROTOs of lamps; see `unknown_light`."""
    return (node for node in root.descendants() if node.type_name in _LIGHTS)


def unknown_light(root: SceneNode) -> str | None:
    """Return a description of a node whose light is not simulated, such as "a CeilingLight", or None."""
    for node in root.descendants():
        if node.type_name == _BACKGROUND and (node.text("texture") or _MOUNTAINS) != _MOUNTAINS:
            return f"a {_BACKGROUND} with the texture {node.text('texture')}"
        if (name := node.proto_name or node.type_name) in _LAMPS:
            return f"a {name}"
    return None


def _cosine(one: Vector, other: Vector) -> float:
    """Return the cosine of the angle between two directions; 0 if the angle is above 90 degrees."""
    length = math.hypot(*one) * math.hypot(*other)
    return max(0.0, dot(one, other) / length) if length else 0.0


def _far(direction: Vector) -> Vector:
    """Return the way to a light that has a direction but no location."""
    length = math.hypot(*direction)
    if length == 0.0:
        return direction
    x, y, z = direction
    return x * _FAR_M / length, y * _FAR_M / length, z * _FAR_M / length


def _opposite(vector: Vector) -> Vector:
    x, y, z = vector
    return -x, -y, -z


def _number(node: SceneNode, name: str, default: float) -> float:
    numbers = node.numbers(name)
    return numbers[0] if numbers and len(numbers) == 1 else default


def _vector(node: SceneNode, name: str, default: Vector) -> Vector:
    numbers = node.numbers(name)
    if numbers is None or len(numbers) != len(default):
        return default
    x, y, z = numbers
    return x, y, z
