"""Textures under infra-red sensors: formulas give the pixel that a ray meets on each shape."""

import math

import numpy as np
import pytest

from palaestra_sim.scene import png
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from tests.tables import for_each
from tests.values import rays
from tests.values.frames import frame, looking
from tests.values.standing import MOUNT
from tests.values.worlds import PHYSICS, STEP_MS, device, move, robot

COLUMNS, ROWS = 8, 4
REDS = np.arange(20, 20 + 7 * COLUMNS * ROWS, 7).reshape(ROWS, COLUMNS)  # each pixel has another value
OTHERS = REDS[::-1, ::-1]
REACH_M = 30.0
PLACE = frame((3.0, -1.0, 0.5), (0.3, -0.5, 0.8), 1.1)
INFRARED = f"""DistanceSensor {{ name "eye" {MOUNT.fields} type "infra-red"
  lookupTable [ 0 0 0, {REACH_M} {REACH_M} 0 ] }}"""


def picture(reds):
    """Return a PNG file with these red values, (rows, columns); blue and green have no effect."""
    pixels = np.full((*reds.shape, 4), 200, np.uint8)
    pixels[:, :, 2] = reds
    return png.encode((reds.shape[1], reds.shape[0]), pixels.tobytes())


@pytest.fixture
def project(tmp_path):
    """Return the folder of a world, in a project that has two images in a folder next to it."""
    folder = tmp_path / "project" / "worlds"
    (folder / "textures").mkdir(parents=True)
    (folder / "textures" / "reds.png").write_bytes(picture(REDS))
    (folder / "textures" / "others.png").write_bytes(picture(OTHERS))
    return folder


@pytest.fixture(params=PHYSICS)
def load(request, project):
    """`load(nodes)` returns the simulation of a world with these nodes, in the project."""

    def load(nodes, folder=project):
        world = folder / "line.wbt"
        text = f"#VRML_SIM R2023b utf8\nWorldInfo {{ basicTimeStep {STEP_MS} }}\n{nodes}\n"
        world.write_text(text, encoding="utf-8")
        return Loader(physics=PHYSICS[request.param])(world, Mode.FAST)

    return load


TEXTURE = 'ImageTexture { url [ "textures/reds.png" ] }'
LOOK = f"PBRAppearance {{ roughness 0 baseColorMap {TEXTURE} }}"


def shape(geometry, look=LOOK):
    """Return a Solid with one shape, and a robot with an infra-red sensor."""
    solid = f"Solid {{ {PLACE.fields} children [ Shape {{ appearance {look} geometry {geometry} }} ] }}"
    return solid + robot(INFRARED)


def red_at(u, v, reds=REDS):
    """Return the red value of a pixel, 0 to 1; u goes right and v goes down, each from 0 to 1."""
    return reds[int(v * ROWS), int(u * COLUMNS)] / 255.0


def around(x, y):
    """Return the azimuth of a point as a share of a turn from +y, counter-clockwise as seen from above."""
    return math.atan2(-x, y) / (2.0 * math.pi) % 1.0


def on_box(point):
    """Return the texture coordinates on a box of 2 x 1 x 0.5 m; each side shows the whole texture.

    On the sides the texture is upright as seen from outside; on the top, x is to the right and y is up.
    """
    x, y, z = np.array(point) / [2.0, 1.0, 0.5] + 0.5
    side = max(range(3), key=lambda axis: abs(np.array([x, y, z])[axis] - 0.5))
    towards = np.sign([x - 0.5, y - 0.5, z - 0.5][side])
    if side == 2:
        return x, (1.0 - y if towards > 0 else y)
    right = (y if towards > 0 else 1.0 - y) if side == 0 else (1.0 - x if towards > 0 else x)
    return right, 1.0 - z


def on_cylinder(point):
    """Return the texture coordinates on a cylinder of 0.5 m radius and 1 m height, whose ends show discs."""
    x, y, z = point
    if abs(z) > 0.5 - 1e-9:
        return x + 0.5, (0.5 - y if z > 0 else 0.5 + y)
    return around(x, y), 0.5 - z


def on_sphere(point):
    """Return the texture coordinates on a ball of 0.5 m radius, by meridians and circles of latitude."""
    x, y, z = point
    return around(x, y), 0.5 - math.asin(z / 0.5) / math.pi


SIDES = [(1, 0.3), (-1, 0.7), (-0.6, -1), (0.8, -1)]
# Each row: a geometry, a function that returns the length of a ray to it, and a function from a point of its
# surface to texture coordinates.
CASES = [
    (
        "Plane { size 4 2 }",
        rays.plane,
        lambda point: (point[0] / 4.0 + 0.5, 0.5 - point[1] / 2.0),
        [((0.3, 0.2, 1.0), (x, y, 0.0)) for x in (-1.9, -0.7, 0.2, 1.6) for y in (-0.9, 0.1, 0.6)],
    ),
    (
        "Box { size 2 1 0.5 }",
        lambda *ray: rays.box(*ray, (2.0, 1.0, 0.5)),
        on_box,
        [
            ((3.0, 0.5, 0.3), (1.0, -0.4, 0.2)),
            ((3.0, 0.5, 0.3), (1.0, 0.2, -0.1)),
            ((-3.0, 0.5, 0.3), (-1.0, -0.4, 0.2)),
            ((0.3, 2.0, 0.3), (-0.8, 0.5, 0.1)),
            ((0.3, -2.0, 0.3), (0.7, -0.5, -0.2)),
            ((0.3, 0.2, 2.0), (0.9, -0.4, 0.25)),
            ((0.3, 0.2, -2.0), (-0.6, 0.3, -0.25)),
        ],
    ),
    (
        "Cylinder { radius 0.5 height 1 }",
        lambda *ray: rays.cylinder(*ray, 0.5, 1.0),
        on_cylinder,
        [
            *(((2 * c, 2 * s, 0.2), (0.1 * s, 0.1 * c, -0.3)) for c, s in SIDES),
            ((0.1, 0.2, 2.0), (0.3, -0.2, 0.5)),
            ((0.1, 0.2, -2.0), (-0.3, 0.1, -0.5)),
        ],
    ),
    (
        "Sphere { radius 0.5 }",
        lambda *ray: rays.sphere(*ray, 0.5),
        on_sphere,
        [((2 * c, 2 * s, 0.4), (0.1, 0.05, z)) for c, s in SIDES for z in (0.3, -0.2)],
    ),
]


def read(simulation, start, target):
    """Return the reading of a sensor at `start` that looks at `target`, both in the frame of the shape."""
    move(simulation, "R", PLACE @ looking(start, target, 0.3) @ MOUNT.inverse)
    simulation.step(STEP_MS)
    return device(simulation, "eye").value


def met(distance, start, target):
    """Return the distance of a ray and the point that it meets, both in the frame of the shape."""
    ahead = np.subtract(target, start) / np.linalg.norm(np.subtract(target, start))
    way = distance(np.array(start), ahead)
    return way, start + way * ahead


@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0].split()[0])
def test_a_ray_sees_the_pixel_that_it_meets(case, load):
    """A line follower then reads the line where Webots would paint it."""
    geometry, distance, place, aims = case
    simulation = load(shape(geometry))
    for start, target in aims:
        way, point = met(distance, start, target)
        expected = way / (0.2 + 0.8 * red_at(*place(point)))
        assert read(simulation, start, target) == pytest.approx(expected, rel=1e-6), (start, target)


BESIDE = 'ImageTexture { url "textures/others.png" }'
PAINTED = "PBRAppearance { baseColor 0.5 1 1 roughness 0.4 transparency 0.25 baseColorMap %s }"
PHONG = "Appearance { material Material { diffuseColor 0.1 0 0 transparency 0.25 } texture %s }"
LOOKS = [
    (PAINTED % TEXTURE, 0.375, 0.8),
    (PHONG % TEXTURE, 0.75, 1.0),
    (f"Appearance {{ texture {TEXTURE} }}", 1.0, 1.0),
]
# The pixel in the third column and the second row of a Plane of 4 x 2 m.
CENTER = ((0.3, 0.2, 1.0), (-0.7, 0.4, 0.0))


@for_each("look, share, smooth", LOOKS)
def test_base_color_and_roughness_count_with_the_texture(look, share, smooth, load):
    """In an Appearance the texture replaces the diffuse color, as in Webots."""
    way, _ = met(rays.plane, *CENTER)
    red = share * REDS[1, 2] / 255.0

    assert read(load(shape("Plane { size 4 2 }", look)), *CENTER) == pytest.approx(
        way / (0.2 + 0.8 * red * smooth)
    )


def test_maps_of_roughness_and_occlusion_count(load):
    """The red value of each map's pixel counts, at the same texture coordinates."""
    way, _ = met(rays.plane, *CENTER)
    other = OTHERS[1, 2] / 255.0
    look = f"PBRAppearance {{ baseColorMap {TEXTURE} roughnessMap {BESIDE} occlusionMap {BESIDE} }}"
    factor = 0.2 + 0.8 * REDS[1, 2] / 255.0 * (1.0 - other / 2.0) ** 2

    assert read(load(shape("Plane { size 4 2 }", look)), *CENTER) == pytest.approx(way / factor)


def transformed(u, v, scale, rotation, center, translation):
    """Return the texture coordinates after a TextureTransform of X3D, in which v is up."""
    c, s = math.cos(rotation), math.sin(rotation)
    move = np.array([[1, 0, translation[0]], [0, 1, translation[1]], [0, 0, 1]])
    to_center = np.array([[1, 0, center[0]], [0, 1, center[1]], [0, 0, 1]])
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    grown = np.diag([*scale, 1.0])
    u, up, _ = np.linalg.inv(to_center) @ grown @ turned @ to_center @ move @ [u, 1.0 - v, 1.0]
    return u, 1.0 - up


BOUNDS = [
    ("", lambda place: place % 1.0),
    ("repeatS FALSE repeatT FALSE", lambda place: min(max(place, 0.0), 0.9999)),
]
TRANSFORMS = [
    ((1.0, 1.0), 0.0, (0.0, 0.0), (0.3, -0.2)),
    ((3.0, 2.0), 0.0, (0.0, 0.0), (0.0, 0.0)),
    ((1.0, 1.0), 0.6, (0.0, 0.0), (0.0, 0.0)),
    ((2.0, 0.7), -1.1, (0.4, -0.3), (0.25, 0.1)),
]


@for_each("scale, rotation, center, translation", TRANSFORMS)
def test_a_texture_transform_moves_turns_and_scales_the_texture(scale, rotation, center, translation, load):
    """The transform follows X3D.

    The texture repeats beyond its edges, but with `repeatS FALSE` its edge continues.
    """
    node = f"""TextureTransform {{ scale {scale[0]} {scale[1]} rotation {rotation}
      center {center[0]} {center[1]} translation {translation[0]} {translation[1]} }}"""
    for fields, bound in BOUNDS:
        texture = TEXTURE.replace("}", f"{fields} }}")
        look = f"PBRAppearance {{ baseColorMap {texture} textureTransform {node} }}"
        simulation = load(shape("Plane { size 4 2 }", look))
        for target in ((-1.4, 0.3, 0.0), (0.9, -0.6, 0.0), (1.7, 0.8, 0.0)):
            way, point = met(rays.plane, CENTER[0], target)
            u, v = transformed(
                point[0] / 4.0 + 0.5, 0.5 - point[1] / 2.0, scale, rotation, center, translation
            )
            expected = way / (0.2 + 0.8 * red_at(bound(u), bound(v)))
            assert read(simulation, CENTER[0], target) == pytest.approx(expected, rel=1e-6), (target, fields)


ARENA = """RectangleArena {{ floorSize 2 1 {order} wallThickness 0.1 wallHeight 0.3 }}"""
FLOOR = f"floorTileSize 0.5 0.25 floorAppearance {LOOK}"
WALL = "wallAppearance PBRAppearance { baseColor 0.3 1 1 roughness 0 }"


@pytest.mark.parametrize("order", [f"{FLOOR} {WALL}", f"{WALL} {FLOOR}"], ids=["floor first", "walls first"])
def test_the_floor_of_an_arena_has_its_texture_by_tiles(order, load):
    """Line followers drive in such arenas.

    The tiles start at the lower left corner, and the walls have their own appearance.
    """
    simulation = load(ARENA.format(order=order) + robot(INFRARED))
    start = np.array([0.2, -0.1, 0.4])
    for target in ((-0.9, 0.4, 0.0), (0.3, 0.2, 0.0), (0.33, -0.45, 0.0)):
        move(simulation, "R", looking(start, target, 0.3) @ MOUNT.inverse)
        simulation.step(STEP_MS)
        u, up = (target[0] + 1.0) / 0.5 % 1.0, (target[1] + 0.5) / 0.25 % 1.0
        expected = np.linalg.norm(start - target) / (0.2 + 0.8 * red_at(u, 1.0 - up))
        assert device(simulation, "eye").value == pytest.approx(expected, rel=1e-6), target

    target = np.array([1.0, 0.1, 0.2])  # on the wall
    move(simulation, "R", looking(start, target, 0.3) @ MOUNT.inverse)
    simulation.step(STEP_MS)
    assert device(simulation, "eye").value == pytest.approx(
        np.linalg.norm(start - target) / (0.2 + 0.8 * 0.3)
    )
    assert simulation.unread_textures == 0


def test_a_texture_whose_place_is_not_known_counts_as_unread(load):
    """The base color then counts instead of the texture, and the simulation counts the texture as unread."""
    look = LOOK.replace("baseColorMap", "baseColor 0.5 1 1 baseColorMap")
    nodes = [f"Shape {{ appearance {look} geometry {geometry} }}" for geometry in ("Cone { }", "Plane { }")]
    nodes.append(f"CircleArena {{ translation 9 0 0 floorAppearance {look} }}")
    nodes.append(f"Shape {{ appearance {look.replace('reds.png', 'missing.png')} geometry Box {{ }} }}")
    simulation = load(" ".join(nodes) + robot(INFRARED))
    move(simulation, "R", frame((9.2, 0.1, 1.0), (0, 1, 0), math.pi / 2) @ MOUNT.inverse)
    simulation.step(STEP_MS)

    assert simulation.unread_textures == 3
    assert device(simulation, "eye").value == pytest.approx(1.0 / (0.2 + 0.8 * 0.5))
