"""Infra-red sensors and lidars see shapes and their colors, not boundingObjects.

The expected values come from formulas, and both simulators must return them.
"""

import math
import random

import numpy as np
import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.fields import FieldType
from palaestra_sim.stub.physics import StubPhysics
from tests.tables import for_each

WORLD = """#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep 16 }}
{objects}
DEF R Robot {{
  {pose}
  children [ {devices} ]
  name "r" controller "ros" controllerArgs [ "--name=rob" "--synchronize" ] supervisor TRUE
}}
"""
INFRARED = 'DistanceSensor { name "eye" type "infra-red" lookupTable [ 0 0 0, 40 40 0 ] }'
LIDAR = """Lidar { name "lidar" fieldOfView 6.2831853 horizontalResolution 36 numberOfLayers 3
  verticalFieldOfView 0.6 minRange 0.05 maxRange 9 }"""


@pytest.fixture
def begin(load):
    """`begin(objects, devices, pose)` returns the simulation after a step."""

    def begin(objects, devices, pose=""):
        simulation = load(WORLD.format(objects=objects, devices=devices, pose=pose).encode())
        for kind, device in simulation.robots[0].parts.devices.rows.values():
            if kind.node == "Lidar":
                device.enabled(16)
        simulation.step(16)
        return simulation

    return begin


def measured(simulation, name="eye"):
    """Return the value of a sensor."""
    return simulation.robots[0].sensors[name].value


def scanned(simulation):
    """Return the distances of the lidar in meters, (layers, rays)."""
    _, lidar = simulation.robots[0].parts.devices.rows["lidar"]
    return np.frombuffer(lidar.value, np.float32).reshape(3, 36)


def wall(appearance="", distance=1.0, outline=""):
    """Return a wall whose surface is at that distance in front of the origin."""
    return f"""Solid {{ translation {distance + 0.05} 0 0 {outline} children [
        Shape {{ appearance {appearance or "NULL"} geometry Box {{ size 0.1 3 1 }} }} ] }}"""


COLORS = [
    ("PBRAppearance { baseColor 0 0 0 roughness 1 }", 0.2),
    ("PBRAppearance { baseColor 0 1 1 }", 0.2),
    ("PBRAppearance { baseColor 1 0 0 roughness 0 }", 1.0),
    ("PBRAppearance { baseColor 1 0 0 roughness 1 }", 0.6),
    ("PBRAppearance { baseColor 0.5 0.5 0.5 roughness 0.5 }", 0.5),
    ("PBRAppearance { baseColor 1 1 1 transparency 0.5 }", 0.6),
    ("Appearance { material Material { diffuseColor 0.25 1 1 } }", 0.4),
    ("Appearance { material Material { diffuseColor 1 1 1 transparency 0.25 } }", 0.8),
    ("Appearance { }", 1.0),
    ("", 1.0),
]
POSES = [
    ("", 1.0),
    ("translation -1.5 0.2 0.1", 2.5),
    ("rotation 0 0 1 0.5", 1.0 / math.cos(0.5)),
    ("rotation 0 1 0 0.3", 1.0 / math.cos(0.3)),
]


@for_each("appearance, factor", COLORS)
def test_a_dark_or_rough_surface_seems_farther(begin, appearance, factor):
    """As in Webots, the value is distance / (0.2 + 0.8 red (1 - roughness / 2)) in every pose.

    The opacity scales the red value.
    """
    for pose, distance_m in POSES:
        value = measured(begin(wall(appearance), INFRARED, pose))
        assert value == pytest.approx(distance_m / factor, 1e-6)


def test_infrared_rays_meet_what_is_drawn(begin):
    """The ray passes a boundingObject without a shape, and meets a shape without a boundingObject."""
    outline = "Solid { translation 0.5 0 0 boundingObject Box { size 0.1 1 1 } }"

    assert measured(begin(outline + wall(), INFRARED)) == pytest.approx(1.0)
    assert measured(begin(outline, INFRARED)) == 40.0


@pytest.mark.parametrize("name", ["infra-red", "infrared", "Infra-Red"])
def test_several_rays_are_averaged_before_the_color_counts(begin, name):
    """The value is the mean distance divided by the mean reflection.

    Webots accepts both names of the type.
    """
    sensor = f"""DistanceSensor {{ name "eye" type "{name}" numberOfRays 2 aperture 1.0 gaussianWidth 1e6
        lookupTable [ 0 0 0, 40 40 0 ] }}"""
    half = """Solid {{ translation 1.05 0 {} children [ Shape {{
        appearance PBRAppearance {{ baseColor {} 0 0 roughness 0 }} geometry Box {{ size 0.1 9 2 }} }} ] }}"""
    walls = half.format("1", "1") + half.format("-1", "0")

    assert measured(begin(walls, sensor)) == pytest.approx(1.0 / math.cos(0.5) / 0.6, 1e-6)


def test_a_laser_has_one_ray_whatever_the_file_says(begin):
    """Webots corrects `numberOfRays` to 1 with a warning."""
    laser = 'DistanceSensor { name "eye" type "Laser" numberOfRays 5 lookupTable [ 0 0 0, 40 40 0 ] }'
    outlined = wall(outline="boundingObject Box { size 0.1 3 1 }")

    assert measured(begin(outlined, laser)) == pytest.approx(1.0)


SONAR = """DistanceSensor {{ name "eye" type "sonar" numberOfRays {} aperture 0.6 translation 0 0 9
  rotation {} lookupTable [ 0 0 0, 9 9 0 ] }}"""
HIGH = wall(outline="boundingObject Box { size 0.1 99 99 }")


@for_each("turn", [0.0, 0.1, -0.3, 0.38, 0.41, -0.6, 1.0])
def test_a_sonar_gets_no_echo_from_a_slanted_wall(begin, turn):
    """Beyond an angle of incidence of 22.5 degrees the sonar measures its maximum distance."""
    for axis in ("0 0 1", "0 1 0"):
        value = measured(begin(HIGH, SONAR.format(1, f"{axis} {turn}")))

        expected = 1.0 / math.cos(turn) if abs(turn) < math.pi / 8 else 9.0
        assert value == pytest.approx(expected, 1e-5), axis


def test_a_sonar_takes_the_nearest_of_the_rays_that_return(begin):
    """One of the three rays meets the wall too far from its normal. The other two return equal distances."""
    value = measured(begin(HIGH, SONAR.format(3, "0 0 1 0.2")))

    towards = math.cos(0.3) * math.cos(0.2) + math.sin(0.3) / 2 * math.sin(0.2)
    assert value == pytest.approx(1.0 / towards, 1e-5)


def test_a_sonar_hears_a_post(begin):
    """A round post reflects a ray that meets its middle, but not a ray that meets its side."""
    post = "Solid {{ translation 1 {} 0 boundingObject Cylinder {{ radius 0.2 height 99 }} }}"

    assert measured(begin(post.format(0), SONAR.format(1, "0 0 1 0"))) == pytest.approx(0.8, 1e-5)
    assert measured(begin(post.format(0.15), SONAR.format(1, "0 0 1 0"))) == 9.0


SHAPES = [
    ("Box { size 1 2 3 }", "", 1.5),
    ("Sphere { radius 0.5 }", "", 1.5),
    ("Cylinder { radius 0.25 height 1 }", "", 1.75),
    ("Cylinder { radius 0.25 height 1 }", "rotation 0 1 0 1.5707963", 1.5),
    ("Capsule { radius 0.25 height 1 }", "rotation 0 1 0 1.5707963", 1.25),
    ("Capsule { radius 0.25 height 1 }", "", 1.75),
    ("Cone { bottomRadius 0.5 height 1 }", "rotation 0 1 0 -1.5707963", 1.5),
    ("Box { size 1 1 1 }", "rotation 0 0 1 0.7853982", 2.0 - math.sqrt(0.5)),
    (
        """IndexedFaceSet { coord Coordinate { point [ -0.5 -1 -1, -0.5 1 -1, -0.5 1 1, -0.5 -1 1 ] }
            coordIndex [ 0, 3, 2, 1, -1 ] }""",
        "",
        1.5,
    ),
]


@for_each("geometry, turned, distance_m", SHAPES)
def test_a_lidar_sees_the_shapes(begin, geometry, turned, distance_m):
    """Webots renders the visible shapes for a lidar.

    The test reads the middle ray of the middle layer, which points along x.
    """
    pose = "rotation 0 0 1 0.0872665"  # half of the angle between two rays
    shape = f"Solid {{ translation 2 0 0 {turned} children [ Shape {{ geometry {geometry} }} ] }}"

    simulation = begin(shape, LIDAR, pose)

    assert scanned(simulation)[1, 18] == pytest.approx(distance_m, 1e-4)


def test_what_moves_is_seen_where_it_is(begin):
    """After a supervisor moves the wall, both sensors measure the new distance."""
    simulation = begin("DEF WALL " + wall(), INFRARED + LIDAR, "rotation 0 0 1 0.0872665")
    before = (measured(simulation), scanned(simulation)[1, 18])

    moved = simulation.tree.of_def("WALL")
    simulation.tree.field_of(moved, "translation", simulation).set(FieldType.VEC3F, 0, (2.05, 0.0, 0.0))
    simulation.step(16)

    assert before == pytest.approx((1.0 / math.cos(0.0872665), 1.0), 1e-4)
    assert measured(simulation) == pytest.approx(2.0 / math.cos(0.0872665))
    assert scanned(simulation)[1, 18] == pytest.approx(2.0, 1e-4)


def test_rays_pass_the_robot_and_what_is_around_it(begin):
    """The robot's own parts are often simpler here than in Webots, so its rays pass them.

    The rays also pass a surface from its inside, which Webots does not draw.
    """
    own = "Solid { translation 0.3 0 0 children [ Shape { geometry Box { size 0.1 1 1 } } ] }"
    around = "Solid { children [ Shape { geometry Sphere { radius 30 } } ] }"

    simulation = begin(around + wall(), INFRARED + LIDAR + own, "rotation 0 0 1 0.0872665")

    assert measured(simulation) == pytest.approx(1.0 / math.cos(0.0872665))
    assert scanned(simulation)[1, 18] == pytest.approx(1.0, 1e-4)
    assert scanned(simulation)[1, 0] == math.inf


def test_both_simulators_see_the_same():
    """The world has twenty random shapes of all types.

    The stub and MuJoCo compute the rays with different code, so equal scans support both.
    """
    draw = random.Random(7)
    geometries = [geometry for geometry, _, _ in SHAPES]
    solids = "".join(
        f"""Solid {{ name "s{number}"
            translation {draw.uniform(-6, 6)} {draw.uniform(-6, 6)} {draw.uniform(-1, 1)}
            rotation {draw.random()} {draw.random()} 1 {draw.uniform(-3, 3)}
            children [ Shape {{ geometry {draw.choice(geometries)} }} ] }}"""
        for number in range(20)
    )
    source = WORLD.format(objects=solids, devices=LIDAR, pose="translation 0.1 0.2 0").encode()
    scans = []
    for physics in (StubPhysics(), MujocoPhysics()):
        simulation = Simulation.load(source, physics, "world", Mode.FAST)
        simulation.robots[0].parts.devices.rows["lidar"][1].enabled(16)
        simulation.step(16)
        scans.append(scanned(simulation))

    assert np.isfinite(scans[0]).sum() > 20
    assert scans[0] == pytest.approx(scans[1], abs=1e-4)
