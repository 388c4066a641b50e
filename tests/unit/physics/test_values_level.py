"""Level rays at several heights, on a robot that drives: each meets the objects at its own height."""

from functools import partial

import numpy as np
import pytest

from tests.values import rays
from tests.values.frames import frame
from tests.values.shapes import ELL, SHAPES
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, move, robot

REACH_M = 6.0
HEIGHTS_M = (0.15, 0.5, 0.9)  # the heights of the sensors
AZIMUTHS = (0.0, 0.6, -2.0)
ELL_FORMULA = next(shape.formula for shape in SHAPES if shape.type == "IndexedFaceSet")
QUARTER = np.pi / 2.0
# The objects around the robot, in the axes of the ground: the pose, the shape, and a function that returns
# how far a ray in the shape's frame travels.
AROUND = [
    (
        frame((3.0, 0.0, 0.15), (0, 0, 1), 0.3),
        "Box { size 1 4 0.3 }",
        partial(rays.box, size=(1.0, 4.0, 0.3)),
    ),
    (
        frame((4.5, 0.0, 1.0), (0, 0, 1), -0.2),
        "Box { size 0.2 6 2 }",
        partial(rays.box, size=(0.2, 6.0, 2.0)),
    ),
    (frame((0.0, 3.0, 0.3)), "Sphere { radius 0.6 }", partial(rays.sphere, radius=0.6)),
    (
        frame((-2.0, 2.5, 0.4), (0, 1, 0), QUARTER),
        "Cylinder { radius 0.4 height 1.5 }",
        partial(rays.cylinder, radius=0.4, height=1.5),
    ),
    (
        frame((-3.0, -0.5, 0.6)),
        "Capsule { radius 0.3 height 0.6 }",
        partial(rays.capsule, radius=0.3, height=0.6),
    ),
    (
        frame((-1.5, -3.0, 0.5), (0.6, 0.8, 0), QUARTER),
        "Capsule { radius 0.3 height 2 }",
        partial(rays.capsule, radius=0.3, height=2.0),
    ),
    (frame((0.5, -3.5, 0.3), (0, 0, 1), 0.4), ELL, ELL_FORMULA),
    (
        frame((3.0, -3.0, 0.4)),
        "Cylinder { radius 0.5 height 0.8 }",
        partial(rays.cylinder, radius=0.5, height=0.8),
    ),
]
# Two other robots: `OTHER` is low, the one at `MAST` is long and has a mast in its middle.
OTHER = frame((2.0, 2.5, 0.0))
OTHER_SHAPE = "Pose { translation 0 0 0.15 children [ Cylinder { radius 0.4 height 0.3 } ] }"
OTHER_FORMULA = partial(rays.cylinder, radius=0.4, height=0.3)
MAST = frame((-0.6, -1.6, 0.0), angle_rad=0.5)
MAST_SHAPES = """Group { children [
  Pose { translation 0 0 0.2 children [ Box { size 0.9 0.4 0.4 } ] }
  Pose { translation 0.1 0 0.7 children [ Cylinder { radius 0.08 height 0.6 } ] } ] }"""
MAST_FORMULAS = [
    (frame((0.0, 0.0, 0.2)), partial(rays.box, size=(0.9, 0.4, 0.4))),
    (frame((0.1, 0.0, 0.7)), partial(rays.cylinder, radius=0.08, height=0.6)),
]
PLACES = [
    (0.0, 0.0, 0.0),
    (0.5, 0.4, 0.9),
    (-0.6, 0.8, 2.2),
    (0.3, -1.0, -2.5),
    (-1.0, -1.2, 1.5),
    (1.2, 1.0, -0.4),
]
WHEEL = """HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 anchor 0 %s 0.05 }
  device RotationalMotor { name "%s" }
  endPoint Solid { translation 0 %s 0.05 rotation 1 0 0 1.5707963
    boundingObject Cylinder { radius 0.05 height 0.02 } } }"""


@cached
def simulation_of(setting):
    """Return a simulation of a robot on two wheels among these objects and robots."""
    wheels = WHEEL % (0.1, "left", 0.1) + WHEEL % (-0.1, "right", -0.1)
    mounts = {(z, a): frame((0.05, -0.02, z), (0, 0, 1), a or 1e-9) for z in HEIGHTS_M for a in AZIMUTHS}
    sensors = " ".join(
        f'DistanceSensor {{ name "{z} {a}" {mount.fields} lookupTable [ 0 0 0, {REACH_M} {REACH_M} 0 ] }}'
        for (z, a), mount in mounts.items()
    )
    solids = " ".join(
        f'Solid {{ {setting.put(place).fields} name "{index}" boundingObject {shape} }}'
        for index, (place, shape, _) in enumerate(AROUND)
    )
    turned = setting.put(frame()).fields  # z of a robot points up in every system of axes
    other = f"""DEF OTHER Robot {{ {setting.put(OTHER).fields} name "o" controller "<none>"
      boundingObject {OTHER_SHAPE} }}"""
    mast = f"""Robot {{ {setting.put(MAST).fields} name "m" controller "<none>"
      boundingObject {MAST_SHAPES} }}"""
    return setting.load(solids + robot(wheels + sensors, turned) + other + mast)


def expected(pose, height, azimuth, other):
    """Return the distance to the nearest of all shapes along the ray of a sensor."""
    sensor = pose @ frame((0.05, -0.02, height), (0, 0, 1), azimuth)
    distances = [REACH_M]
    shapes = [(place, formula) for place, _, formula in AROUND]
    shapes.append((other @ frame((0.0, 0.0, 0.15)), OTHER_FORMULA))
    shapes += [(MAST @ place, formula) for place, formula in MAST_FORMULAS]
    for place, formula in shapes:
        ray = place.inverse @ sensor
        distances.append(formula(ray.position, ray.rotation[:, 0]))
    return min(distances)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("lifted", [0.0, 0.35], ids=["on the floor", "lifted"])
def test_each_level_ray_meets_what_stands_at_its_height(setting, lifted):
    """A sensor above a low step does not see the step, even after a supervisor has lifted the robot."""
    simulation = simulation_of(setting)
    wrong = []
    for x, y, heading in PLACES:
        pose = frame((x, y, lifted), (0, 0, 1), heading or 1e-9)
        move(simulation, "R", setting.put(pose))
        simulation.step(STEP_MS)
        for height in HEIGHTS_M:
            for azimuth in AZIMUTHS:
                read = device(simulation, f"{height} {azimuth}").value
                wanted = expected(pose, height, azimuth, OTHER)
                if read != pytest.approx(wanted, abs=1e-4):
                    wrong.append((x, y, heading, height, azimuth, read, wanted))
    assert wrong == []


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_ray_passes_below_a_robot_that_was_lifted(setting):
    """A ray meets the other robot only at the heights to which a supervisor has lifted it."""
    simulation = simulation_of(setting)
    pose = frame((0.0, 0.0, 0.0), (0, 0, 1), np.arctan2(2.5, 2.0))
    move(simulation, "R", setting.put(pose))
    for height in (0.0, 0.4):
        other = frame((2.0, 2.5, height))
        move(simulation, "OTHER", setting.put(other))
        simulation.step(STEP_MS)
        for sensor in HEIGHTS_M:
            read = device(simulation, f"{sensor} 0.0").value
            assert read == pytest.approx(expected(pose, sensor, 0.0, other), abs=1e-4), (height, sensor)
    move(simulation, "OTHER", setting.put(OTHER))
