"""Textures for infra-red sensors: the share of light that a shape returns at the point that a ray meets.

The red of the texture's pixel is multiplied by the red of the base color. The coordinates of a point in the
texture are computed as Webots computes them for its rays. Source: WbShape::pickColor, pickUVCoordinate of
WbBox, WbCylinder, WbPlane and WbSphere, WbImageTexture::pickColor and wren's TextureTransform of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene import picture_files
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.world.project_files import ReadFile
from palaestra_sim.world.source import Source

Coordinates = tuple[float, float]
# A function that maps a point of a shape to its coordinates in a texture. The box around the shape reaches
# from -1 to 1 on each axis.
Mapped = Callable[[Vector], Coordinates]
_END: Final = 1.0 - 1e-7  # share of half a cylinder's height; a point beyond it is on the upper or lower face
_UP: Final = 2  # index of the z axis
_PIXEL: Final = 4  # blue, green, red, alpha
_RED: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Image:
    """The red channel of a texture: a byte for each pixel, row by row from the top left.

    Attributes:
        repeats: whether the texture repeats along u and along v; otherwise the pixels of its edge continue.
    """

    width: int
    height: int
    reds: bytes
    repeats: tuple[bool, bool]

    def at(self, place: Coordinates) -> float:
        """Return the red at coordinates u (to the right) and v (down), 0 to 1."""
        u, v = (_bounded(part, repeat=repeat) for part, repeat in zip(place, self.repeats, strict=True))
        row = min(int(v * self.height), self.height - 1)
        column = min(int(u * self.width), self.width - 1)
        return self.reds[row * self.width + column] / 255.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Paint:
    """The look of a textured shape in infra-red light.

    Attributes:
        red: the red of the shape's base color times its opacity, 0 to 1.
        roughness: the roughness of the shape if `rough` is None.
        image, rough, hollow: the textures of the shape's color, roughness and occlusion.
        mapped: maps a point of the shape to coordinates in the textures.
    """

    red: float
    roughness: float
    image: Image
    rough: Image | None
    hollow: Image | None
    mapped: Mapped

    def reflection(self, point: Vector) -> float:
        """Return the share of light that returns from a point, 0.2 to 1."""
        place = self.mapped(point)
        roughness = self.roughness if self.rough is None else self.rough.at(place)
        occlusion = 0.0 if self.hollow is None else self.hollow.at(place)
        return returned_light(self.red * self.image.at(place), roughness, occlusion)


def returned_light(red: float, roughness: float, occlusion: float = 0.0) -> float:
    """Return the share of infra-red light that a surface returns, 0.2 to 1; all arguments are 0 to 1.

    Source: reference/distancesensor.md of Webots, Infra-Red Sensors.
    """
    return 0.2 + 0.8 * red * (1.0 - 0.5 * roughness) * (1.0 - 0.5 * occlusion)


class Textures:
    """The textures of a world; each image is read at its first use.

    Args:
        read: returns the bytes of an image; its arguments are the file that refers to the image, and the
            address in that file. `read` is None if the world has no images.
    """

    def __init__(self, read: ReadFile | None = None) -> None:
        self._read = read
        self._images: dict[tuple[str, str], tuple[int, int, bytes] | None] = {}

    def paint(
        self, look: SceneNode, geometry: str, opaque: float, tiles: Coordinates = (1.0, 1.0)
    ) -> Paint | None:
        """Return the paint of a shape; None without a texture that infra-red sensors see.

        Args:
            look: the Appearance or PBRAppearance of the shape.
            geometry: the type of the shape's geometry.
            opaque: 1 minus the transparency of the shape.
            tiles: the number of copies of the texture along u and along v, from the lower left.
        """
        mapped = MAPPINGS.get(geometry)
        node = texture_of(look)
        image = None if mapped is None or node is None else self._image(node)
        if mapped is None or image is None:
            return None
        transform = _transform(next(iter(look.nodes("textureTransform")), None))
        red = 1.0  # the texture of an Appearance replaces the color
        if look.type_name == "PBRAppearance":
            red = min(1.0, max(0.0, (look.numbers("baseColor") or (1.0,))[0]))
        return Paint(
            red=red * opaque,
            roughness=min(1.0, max(0.0, (look.numbers("roughness") or (0.0,))[0])),
            image=image,
            rough=self._of_field(look, "roughnessMap"),
            hollow=self._of_field(look, "occlusionMap"),
            mapped=lambda point: transform(_tiled(mapped(point), tiles)),
        )

    def _of_field(self, look: SceneNode, field: str) -> Image | None:
        return next((self._image(node) for node in look.nodes(field)), None)

    def _image(self, node: SceneNode) -> Image | None:
        """Return the image of an ImageTexture; None if it cannot be read."""
        address = node.text("url")
        if address is None or node.origin is None or self._read is None:
            return None
        key = (node.origin.source.name, address)
        if key not in self._images:
            self._images[key] = _decoded(self._read, node.origin.source, address)
        found = self._images[key]
        if found is None:
            return None
        width, height, reds = found
        repeats = node.flag("repeatS", True), node.flag("repeatT", True)
        return Image(width=width, height=height, reds=reds, repeats=repeats)


def texture_of(look: SceneNode) -> SceneNode | None:
    """Return the ImageTexture of an appearance, None if it has no texture."""
    field = {"Appearance": "texture", "PBRAppearance": "baseColorMap"}.get(look.type_name, "")
    return next((node for node in look.nodes(field) if node.type_name == "ImageTexture"), None)


def _decoded(read: ReadFile, namer: Source, address: str) -> tuple[int, int, bytes] | None:
    """Return width, height and the red of each pixel of an image; None if it cannot be read."""
    try:
        raster = picture_files.decode(read(namer, address))
    except (OSError, UnsimulatedError):
        return None
    return None if raster is None else (raster.width, raster.height, bytes(raster.pixels[_RED::_PIXEL]))


def _bounded(part: float, *, repeat: bool) -> float:
    if not math.isfinite(part):
        return 0.0
    return part % 1.0 if repeat else max(0.0, min(1.0, part))


def _tiled(place: Coordinates, tiles: Coordinates) -> Coordinates:
    return place[0] * tiles[0], 1.0 - (1.0 - place[1]) * tiles[1]


def _on_plane(point: Vector) -> Coordinates:
    x, y, _ = point
    return (1.0 + x) / 2.0, (1.0 - y) / 2.0


def _on_box(point: Vector) -> Coordinates:
    """Return the texture coordinates of a point of a box; each side of the box shows the whole texture."""
    x, y, z = point
    side = max(range(3), key=lambda axis: abs(point[axis]))
    if side == _UP:
        return (1.0 + x) / 2.0, (1.0 - math.copysign(1.0, z) * y) / 2.0
    along = y if side == 0 else -x
    return (1.0 + math.copysign(1.0, point[side]) * along) / 2.0, (1.0 - z) / 2.0


def _on_cylinder(point: Vector) -> Coordinates:
    x, y, z = point
    if abs(z) > _END:
        return (1.0 + x) / 2.0, (1.0 - math.copysign(1.0, z) * y) / 2.0
    turn = math.asin(max(-1.0, min(1.0, -x)))
    if y < 0.0:
        turn = math.pi - turn
    return turn / (2.0 * math.pi) % 1.0, (1.0 - z) / 2.0


def _on_ball(point: Vector) -> Coordinates:
    x, y, z = point
    around = math.atan2(x, -y) / (2.0 * math.pi)
    return 0.5 + around, 0.5 - math.asin(max(-1.0, min(1.0, z))) / math.pi


MAPPINGS: Final[Mapping[str, Mapped]] = {
    "Box": _on_box,
    "Cylinder": _on_cylinder,
    "Plane": _on_plane,
    "Sphere": _on_ball,
}
"""For each type of geometry, its mapping; infra-red sensors do not see textures on other types."""


def _transform(node: SceneNode | None) -> Callable[[Coordinates], Coordinates]:
    """Return the function of a TextureTransform: move, turn and scale about `center`, with v down."""
    if node is None:
        return lambda place: place
    move_u, move_v = _pair(node, "translation", (0.0, 0.0))
    center_u, center_v = _pair(node, "center", (0.0, 0.0))
    scale_u, scale_v = _pair(node, "scale", (1.0, 1.0))
    rotation = (node.numbers("rotation") or (0.0,))[0]
    c, s = math.cos(rotation), math.sin(rotation)

    def transformed(place: Coordinates) -> Coordinates:
        u, v = place[0] + move_u + center_u, place[1] - move_v - center_v - 1.0
        u, v = c * u + s * v, c * v - s * u
        return u * scale_u - center_u, v * scale_v + center_v + 1.0

    return transformed


def _pair(node: SceneNode, field: str, default: Coordinates) -> Coordinates:
    numbers = node.numbers(field) or default
    return (numbers[0], numbers[1]) if len(numbers) == len(default) else default
