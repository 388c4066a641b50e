"""The settings of a whole world: its floors and, for a physics with forces, gravity and frictions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.validation import NodeReader

DEFAULT: Final = "default"  # the material of a Solid without a contactMaterial
_COULOMB: Final = 1.0  # friction of two materials without ContactProperties
_ENDLESS: Final = 100.0  # replaces -1, which stands for infinite friction in Webots


@dataclass(frozen=True, slots=True)
class Floor:
    """A level Plane of a boundingObject; Webots treats the Plane as infinite.

    Attributes:
        place: the frame of the Solid that has the boundingObject.
        local: the pose of the Plane in that frame.
    """

    place: Frame
    local: Pose

    @property
    def height_m(self) -> float:
        """The current height of the Plane in meters, in the axes of the ground."""
        return self.place.ground_pose.after(self.local).position[2]


@dataclass(frozen=True, slots=True, kw_only=True)
class PhysicsSettings:
    """The settings of a whole world.

    Attributes:
        gravity_m_s2: the downward acceleration.
        frictions: the friction coefficients of the pairs of materials that have ContactProperties.
        floor: the material of the floors.
        floors: the floors of the world; if empty, the world has one floor at height 0.
    """

    gravity_m_s2: float = 9.81
    frictions: Mapping[frozenset[str], float] = field(default_factory=dict)
    floor: str = DEFAULT
    floors: tuple[Floor, ...] = ()

    def floors_m(self) -> tuple[float, ...]:
        """Return the current heights of the floors that the file contains."""
        return tuple(floor.height_m for floor in self.floors)

    def heights_m(self) -> tuple[float, ...]:
        """Return the current heights of the floors; 0 if the file has no floor."""
        return self.floors_m() or (0.0,)

    def friction(self, one: str, other: str) -> float:
        """Return the coefficient of friction of two materials."""
        return self.frictions.get(frozenset((one, other)), _COULOMB)


def read_surroundings(
    reading: NodeReader, world_info: SceneNode | None, floor: SceneNode | None
) -> PhysicsSettings:
    """Return the settings in a WorldInfo; `floor` is a Plane of a boundingObject."""
    material = DEFAULT if floor is None else material_of(floor)
    if world_info is None:
        return PhysicsSettings(floor=material)
    frictions: dict[frozenset[str], float] = {}
    for node in world_info.nodes("contactProperties"):
        pair = frozenset(node.text(f"material{side}") or DEFAULT for side in (1, 2))
        frictions.setdefault(pair, _coefficient(node))
    return PhysicsSettings(gravity_m_s2=reading.gravity(), frictions=frictions, floor=material)


def material_of(node: SceneNode) -> str:
    """Return the material of the Solid, robot or device that contains a part of a boundingObject."""
    owner = next((it for it in node.ancestors() if not it.outline), None)
    return DEFAULT if owner is None else owner.text("contactMaterial") or DEFAULT


def _coefficient(properties: SceneNode) -> float:
    """Return the friction coefficient; if it differs by direction, return the mean."""
    numbers = properties.numbers("coulombFriction") or (_COULOMB,)
    return sum(_ENDLESS if number < 0.0 else number for number in numbers) / len(numbers)
