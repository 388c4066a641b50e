"""Convert the nodes of a world to visible shapes, each with a color and the frame that carries it.

This module reads no textures, so a shape has one color. A stand-in, the placeholder of a
PROTO, has the shapes of its boundingObject in the color of its first appearance. The floor of a stand-in does
not use `wallAppearance`, and the walls do not use `floorAppearance`. A scale stretches a shape along the
shape's own axes, so right angles stay right angles.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector, from_axis_angle, triple
from palaestra_sim.scene.lights import lights_in
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.meshes import Mesh, cone, elevation_grid, face_set
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.nodes.types import is_base_type
from palaestra_sim.scene.old_axes import standing
from palaestra_sim.scene.textures import Textures, texture_of

Kind = Literal["box", "ball", "cylinder", "capsule", "mesh"]
Color = tuple[float, float, float, float]  # red, green, blue, alpha, from 0 to 1

_WHITE: Final = (1.0, 1.0, 1.0)
_STAND_IN: Final = (0.72, 0.70, 0.66)
_FLOOR: Final = (0.45, 0.46, 0.47)  # color of a stand-in's floor; its walls have another color
_PATTERN: Final = (0.7, 0.7, 0.7)  # replaces textures and appearance PROTOs, whose colors are not read
_MATERIAL: Final = (0.8, 0.8, 0.8)  # Source: Material.diffuseColor of Webots
_NIGHT: Final = (0.0, 0.0, 0.0)  # Source: Background.skyColor of Webots
_DAY: Final = (0.62, 0.76, 0.92)  # color that replaces a textured sky
_SHEET_M: Final = 0.002  # a plane is a box of this height; its upper side is the plane
_LARGEST_M: Final = 1e5
_PLACING: Final = frozenset(("translation", "rotation"))
_LOOKING: Final = _PLACING | {"scale"}
# The types of nodes that describe the look of a shape, or of the sky.
_LOOKS: Final = frozenset(
    (
        "Appearance",
        "Background",
        "Box",
        "Capsule",
        "Cone",
        "Coordinate",
        "Cylinder",
        "ElevationGrid",
        "ImageTexture",
        "IndexedFaceSet",
        "Material",
        "Mesh",
        "PBRAppearance",
        "Plane",
        "Shape",
        "Sphere",
        "TextureTransform",
    )
)
_OF_FILES: Final = frozenset(("CadShape", "Mesh"))
# For each PROTO with a floor, the field with the size of the floor's texture.
_TILES: Final = {"Floor": "tileSize", "RectangleArena": "floorTileSize"}
_TILE_M: Final = (0.5, 0.5)  # Source: Floor.proto of Webots
_HOLDING: Final = ("children", "endPoint")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawn:
    """One visible shape.

    Attributes:
        kind: the kind of shape; a "ball" whose three sizes differ is an ellipsoid.
        size: x, y, z in meters; for round shapes 2 r, 2 r, height; for a mesh, its scale factors.
        color: red, green, blue and alpha of the whole shape, 0 to 1.
        local: the pose of the shape in the frame `place`; the lengths are meters of the world, with all
            scales applied.
        place: the frame that carries the shape; None for the world.
        node: the Shape, or the stand-in.
        mesh: the triangles of the kind "mesh".
        roughness: the roughness of a PBRAppearance, 0 to 1.
        geometry: the type of the shape's geometry, such as "Plane".
        look: the shape's appearance; None without an appearance, or if the texture's position on the shape is
            unknown.
        textured: whether the appearance has a texture.
        tiles: the number of copies of the texture along x and along y.
    """

    kind: Kind
    size: Vector
    color: Color
    local: Pose
    place: Frame | None
    node: SceneNode
    mesh: Mesh | None = None
    roughness: float = 0.0
    geometry: str = ""
    look: SceneNode | None = None
    textured: bool = False
    tiles: tuple[float, float] = (1.0, 1.0)

    @property
    def pose(self) -> Pose:
        """The current pose of the shape in the world."""
        return self.local if self.place is None else self.place.world_pose.after(self.local)


def drawn(root: SceneNode, files: MeshFiles | None = None) -> Iterator[Drawn]:
    """Yield the visible shapes of a node and of all nodes inside it, with their current fields and frames.

    `files` are the mesh files that nodes name; a Mesh whose file cannot be read has no shape.
    """
    yield from _inside(root, _Frame(files or MeshFiles()))


class View:
    """The visible part of a world, with counts of its changes.

    Args:
        root: the root of the world.
        textures: the images of the world's textures; by default no image can be read.
        mesh_files: the mesh files that nodes name; by default no file can be read.

    Attributes:
        root: the root of the world.
        textures: the images of the world's textures.
        mesh_files: the mesh files that nodes name.
        changes: the number of times that a node was added or removed, or that the look of a node changed.
        moves: the number of times that a client or a reset moved a node; motion by motors and by the physics
            does not count.
    """

    def __init__(
        self, root: SceneNode, textures: Textures | None = None, mesh_files: MeshFiles | None = None
    ) -> None:
        self.root = root
        self.textures = textures or Textures()
        self.mesh_files = mesh_files or MeshFiles()
        self.changes = 0
        self.moves = 0
        # The number of changes when the lights were collected.
        self._lights: tuple[int, tuple[SceneNode, ...]] = (-1, ())

    def written(self, node: SceneNode, field: str) -> None:
        """Count the write of a field, if its effect is visible."""
        if field in _PLACING and node.place is not None:
            self.moves += 1
        elif node.stand_in or node.type_name in _LOOKS or field in _LOOKING:
            self.changes += 1

    def things(self) -> tuple[Drawn, ...]:
        """Return the current visible shapes."""
        return tuple(drawn(self.root, self.mesh_files))

    def lights(self) -> tuple[SceneNode, ...]:
        """Return the current lights."""
        if self._lights[0] != self.changes:
            self._lights = (self.changes, tuple(lights_in(self.root)))
        return self._lights[1]

    def unread_textures(self) -> int:
        """Return the number of shapes with a texture that infra-red sensors do not see."""
        paint = self.textures.paint
        textured = (thing for thing in self.things() if thing.textured)
        return sum(it.look is None or paint(it.look, it.geometry, 1.0) is None for it in textured)

    def unread_meshes(self) -> Mapping[str, int]:
        """Return the number of shapes, by type, that no sensor sees.

        The file of such a shape is not read, or its type is a PROTO whose file the project does not have.
        """
        nodes = list(self.root.descendants())
        hidden = {inside for node in nodes for inside in node.outlining()}
        unknown = {it for node in nodes for it in node.nodes("geometry") if not is_base_type(it.type_name)}
        named = (it for it in nodes if it not in hidden and (it.type_name in _OF_FILES or it in unknown))
        return Counter(it.type_name for it in named if it.type_name != "Mesh" or not self._reads(it))

    def _reads(self, node: SceneNode) -> bool:
        try:
            self.mesh_files.mesh_of(node)
        except ValueError:
            return False
        return True

    def sky(self) -> Vector:
        """Return the color of the background, red, green and blue from 0 to 1."""
        for node in self.root.nodes():
            if node.type_name == "Background":
                return triple(_mixed(node, "skyColor", _NIGHT))
            if "TexturedBackground" in {node.type_name, node.proto_name}:
                return _DAY
        return _NIGHT


class _Frame(NamedTuple):
    """A frame relative to `place`, and the factors by which the frame scales its contents along its axes.

    `files` are the mesh files of the world.
    """

    files: MeshFiles
    place: Frame | None = None
    pose: Pose = Pose()
    scale: Vector = (1.0, 1.0, 1.0)

    def at(self, position: Vector) -> Pose:
        """Return the pose of a frame at a position in this frame, with the same axes."""
        x, y, z = (at * factor for at, factor in zip(position, self.scale, strict=True))
        return self.pose.after(Pose((x, y, z)))

    def within(self, node: SceneNode) -> _Frame:
        """Return the frame of a node whose parent has this frame."""
        scale = (1.0, 1.0, 1.0) if node.stand_in else _numbers(node, "scale", (1.0, 1.0, 1.0))
        place = node.place
        if place is not None:
            # A scale with equal factors is already contained in `place.scale`.
            x, y, z = scale if len(set(scale)) > 1 else (1.0, 1.0, 1.0)
            return _Frame(self.files, place, Pose(), (place.scale * x, place.scale * y, place.scale * z))
        turned = _numbers(node, "rotation", (0.0, 0.0, 1.0, 0.0))
        pose = self.at(triple(_numbers(node, "translation", (0.0, 0.0, 0.0))))
        x, y, z = (factor * inner for factor, inner in zip(self.scale, scale, strict=True))
        rotation = from_axis_angle((turned[0], turned[1], turned[2], turned[3]))
        return _Frame(self.files, self.place, pose.after(Pose(rotation=rotation)), (x, y, z))


def _inside(node: SceneNode, frame: _Frame) -> Iterator[Drawn]:
    if node.type_name == "Shape":
        look = _of_shape(node)
        for geometry in node.nodes("geometry"):
            yield from _geometry(geometry, frame, look, node)
    elif node.left_out and node.type_name != "Robot":
        return
    elif node.stand_in:
        yield from _stand_in(node, frame.within(node))
    else:
        inner = frame.within(node)
        for name in _HOLDING:
            for child in node.nodes(name):
                yield from _inside(child, inner)


def _stand_in(node: SceneNode, frame: _Frame) -> Iterator[Drawn]:
    floor, others = _stand_in_look(node, "wallAppearance"), _stand_in_look(node, "floorAppearance")
    tile = _tile(node)
    floor = floor._replace(tile=tile) if tile else floor._replace(node=None)
    for outline in node.nodes("boundingObject"):
        for pose in outline.nodes():
            for geometry in pose.nodes():
                is_floor = geometry.type_name == "Plane"
                look = floor if is_floor else others._replace(node=None)
                if not look.color:
                    look = look._replace(color=(*(_FLOOR if is_floor else _STAND_IN), 1.0))
                yield from _geometry(geometry, frame.within(pose), look, node)


def _stand_in_look(node: SceneNode, but: str) -> _Look:
    """Return the look of a stand-in's first appearance outside the field `but`; if none, an empty look."""
    looks = (
        item
        for name, content in node.fields.items()
        for item in content.items
        if name != but and isinstance(item, SceneNode) and item.type_name in {"Appearance", "PBRAppearance"}
    )
    found = next(looks, None)
    return _Look(()) if found is None else _look(found)


def _tile(node: SceneNode) -> tuple[float, float] | None:
    """Return the size of a texture on the floor of a stand-in, in meters; None if it is not known."""
    field = _TILES.get(node.proto_name)
    width, length = (0.0, 0.0) if field is None else _numbers(node, field, _TILE_M)
    return (width, length) if min(width, length) > 0.0 else None


class _Look(NamedTuple):
    """The look of a shape; `node` is None if the position of the texture on the shape is unknown.

    `tile` is the size of one copy of the texture in meters, or None if one copy covers the whole shape.
    """

    color: Color | tuple[()]
    roughness: float = 0.0
    node: SceneNode | None = None
    textured: bool = False
    tile: tuple[float, float] | None = None


def _geometry(node: SceneNode, frame: _Frame, look: _Look, owner: SceneNode) -> Iterator[Drawn]:
    """Yield the shape of a geometry, or nothing if its numbers or its file are invalid."""
    solid = _solid(node, frame)
    if solid is None or not look.color or look.color[3] <= 0.0:
        return
    x, y, z = (length * factor for length, factor in zip(solid.size, frame.scale, strict=True))
    if node.type_name == "Plane":
        z = _SHEET_M
    if min(x, y, z) > 0.0:
        yield Drawn(
            kind=solid.kind,
            size=(x, y, z),
            color=look.color,
            local=solid.pose,
            place=frame.place,
            node=owner,
            mesh=solid.mesh,
            roughness=look.roughness,
            geometry=node.type_name,
            look=look.node,
            textured=look.textured,
            tiles=(1.0, 1.0) if look.tile is None else (x / look.tile[0], y / look.tile[1]),
        )


class _Solid(NamedTuple):
    kind: Kind
    size: Vector
    pose: Pose
    mesh: Mesh | None = None


def _solid(node: SceneNode, frame: _Frame) -> _Solid | None:
    """Return the solid of a geometry in a frame; None if the geometry has no solid."""
    pose = frame.pose
    diameter = 2.0 * _number(node, "radius", 1.0)
    match node.type_name:
        case "Box":
            return _Solid("box", triple(_numbers(node, "size", (0.1, 0.1, 0.1))), pose)
        case "Sphere":
            return _Solid("ball", (diameter, diameter, diameter), pose)
        case "Cylinder":
            height = _number(node, "height", 2.0)
            return _Solid("cylinder", (diameter, diameter, height), standing(node, pose))
        case "Capsule":
            height = _number(node, "height", 2.0) + diameter
            return _Solid("capsule", (diameter, diameter, height), standing(node, pose))
        case "Plane":
            x, y = _numbers(node, "size", (1.0, 1.0))
            below = standing(node, pose).after(Pose((0.0, 0.0, -_SHEET_M / 2.0)))
            return _Solid("box", (x, y, _SHEET_M), below)
    found = _mesh(node, frame)
    return None if found is None else _Solid("mesh", (1.0, 1.0, 1.0), *found)


def _mesh(node: SceneNode, frame: _Frame) -> tuple[Pose, Mesh] | None:
    pose, mesh = frame.pose, None
    match node.type_name:
        case "Cone":
            pose = standing(node, pose)
            mesh = cone(_number(node, "bottomRadius", 1.0), _number(node, "height", 2.0))
        case "IndexedFaceSet":
            mesh = face_set(node)
        case "ElevationGrid":
            pose = standing(node, pose)
            mesh = elevation_grid(node)
        case "Mesh":
            with suppress(ValueError):  # the report on the world counts meshes that are not read
                mesh = frame.files.mesh_of(node)
    return None if mesh is None else (pose, mesh)


def _of_shape(shape: SceneNode) -> _Look:
    look = next(iter(shape.nodes("appearance")), None)
    return _Look((*_WHITE, 1.0)) if look is None else _look(look)


def _look(look: SceneNode) -> _Look:
    """Return the look of an Appearance, of a PBRAppearance, or of an instance of an appearance PROTO."""
    return _plain_look(look)._replace(node=look, textured=texture_of(look) is not None)


def _plain_look(look: SceneNode) -> _Look:
    if look.type_name == "Appearance":
        material = next(iter(look.nodes("material")), None)
        if material is None:
            return _Look((*(_PATTERN if look.nodes("texture") else _WHITE), 1.0))
        return _Look(_mixed(material, "diffuseColor", _MATERIAL))
    if look.type_name == "PBRAppearance":
        color = _mixed(look, "baseColor", _PATTERN if look.nodes("baseColorMap") else _WHITE)
        return _Look(color, min(1.0, max(0.0, _number(look, "roughness", 0.0))))
    return _Look(_mixed(look, "colorOverride", _PATTERN))


def _mixed(node: SceneNode, field: str, default: tuple[float, float, float]) -> Color:
    red, green, blue = (min(1.0, max(0.0, share)) for share in _numbers(node, field, default))
    return red, green, blue, 1.0 - min(1.0, max(0.0, _number(node, "transparency", 0.0)))


def _numbers(node: SceneNode, field: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return as many finite numbers as `default` has; `default` if the field has other values."""
    numbers = node.numbers(field)
    if numbers is None or len(numbers) != len(default):
        return default
    fit = all(math.isfinite(number) and abs(number) <= _LARGEST_M for number in numbers)
    return numbers if fit else default


def _number(node: SceneNode, field: str, default: float) -> float:
    return _numbers(node, field, (default,))[0]
