"""Rays at shapes in known poses have the lengths of formulas, in every simulator and system of axes."""

import numpy as np
import pytest

from tests.values.frames import frame, looking
from tests.values.shapes import FILES, SHAPES
from tests.values.standing import MOUNT
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, enable, move, robot

REACH_M = 9.0
APART_M = 40.0  # distance from one shape to the next
SENSORS = f"""
DistanceSensor {{ name "laser" MOUNTED type "laser" lookupTable [ 0 0 0, {REACH_M} {REACH_M} 0 ] }}
DistanceSensor {{ name "generic" MOUNTED lookupTable [ 0 0 0, {REACH_M} {REACH_M} 0 ] }}
DistanceSensor {{ name "infrared" MOUNTED type "infra-red" lookupTable [ 0 0 0, {REACH_M} {REACH_M} 0 ] }}
Lidar {{ name "lidar" MOUNTED numberOfLayers 1 horizontalResolution 3 fieldOfView 0.6
  minRange 0.01 maxRange {REACH_M} }}
"""
RED = "appearance PBRAppearance { baseColor 1 0 0 roughness 0 }"  # reflects all infra-red light
UPRIGHT = [frame(), frame(axis=(0, 0, 1), angle_rad=0.7)]
LYING = [*UPRIGHT, frame(axis=(0, 1, 0), angle_rad=np.pi / 2), frame(axis=(0.6, 0.8, 0), angle_rad=np.pi / 2)]
POSES = {"Plane": UPRIGHT, "Box": [*UPRIGHT, frame(axis=(1, 0, 0), angle_rad=np.pi / 2)]}
LEANING = [frame(axis=(0.3, -0.5, 0.8), angle_rad=1.1), frame(axis=(1.0, 0.2, 0.1), angle_rad=-0.6)]


def poses_of(shape, setting):
    """Return the poses in which a simulator accepts a shape; the stub rejects tilted shapes."""
    poses = POSES.get(shape.type, LYING)
    return [*poses, *LEANING] if setting.physics == "mujoco" and shape.type != "Plane" else poses


@cached
def simulation_of(setting, shape, outlined):
    """Return a simulation with one shape in all its poses, far apart, and a robot with the sensors."""
    look = f"children [ Shape {{ {RED} geometry {shape.node} }} ]"
    outline = f"boundingObject {shape.node}" if outlined else ""
    solids = " ".join(
        f'Solid {{ {setting.put(place).fields} name "{index}" {look} {outline} }}'
        for index, place in enumerate(places_of(shape, setting))
    )
    simulation = setting.load(solids + robot(SENSORS.replace("MOUNTED", MOUNT.fields)), files=FILES)
    enable(simulation)
    return simulation


def places_of(shape, setting):
    """Return the poses of the shape in the axes of the ground, above the floor at height 0."""
    if shape.type == "Plane":
        return [frame((0.0, 0.0, 0.0)) @ pose for pose in UPRIGHT[:1]]
    poses = poses_of(shape, setting)
    return [frame((APART_M * index, -3.0, 20.0)) @ pose for index, pose in enumerate(poses)]


def cases(shape, setting):
    """Yield, for each ray, the frame of the sensor in the shape's frame, and the frame of the shape."""
    for place in places_of(shape, setting):
        for number, (start, target) in enumerate(shape.aims):
            yield place, looking(start, target, 0.4 * number)


def expected(formula, sensor, angle_rad=0.0):
    """Return the distance by a formula, for a ray that is turned to the left."""
    ahead = sensor.rotation @ [np.cos(angle_rad), np.sin(angle_rad), 0.0]
    return min(formula(sensor.position, ahead), REACH_M)


def read(setting, shape, place, sensor, outlined):
    """Move the sensor to a frame in that of the shape, step, and return the simulation."""
    simulation = simulation_of(setting, shape, outlined)
    move(simulation, "R", setting.put(place @ sensor @ MOUNT.inverse))
    simulation.step(STEP_MS)
    return simulation


def mismatches(shape, setting, outlined, measure):
    """Yield a line for each ray whose measured distance differs from the formula."""
    for place, sensor in cases(shape, setting):
        for name, got, wanted in measure(read(setting, shape, place, sensor, outlined), shape, sensor):
            if not abs(got - wanted) <= shape.tolerance:
                yield f"{name} from {sensor.position} in {place.fields}: {got:.6f}, formula {wanted:.6f}"


def outlines(simulation, shape, sensor):
    """Yield the measured and the right values of sensors whose rays meet boundingObjects."""
    for name in ("laser", "generic"):
        yield name, device(simulation, name).value, expected(shape.formula, sensor)


def sights(simulation, shape, sensor):
    """Yield the measured and the right values of sensors whose rays meet visible shapes."""
    formula = shape.seen or shape.formula
    yield "infrared", device(simulation, "infrared").value, expected(formula, sensor)
    for ray, turned in zip(device(simulation, "lidar").layers[0], (0.2, 0.0, -0.2), strict=True):
        yield f"lidar {turned}", min(ray, REACH_M), expected(formula, sensor, turned)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("shape", [it for it in SHAPES if it.bounding], ids=str)
def test_a_ray_meets_a_bounding_object_where_the_formula_says(shape, setting):
    """A policy that avoids walls must see each wall at its true distance."""
    assert list(mismatches(shape, setting, True, outlines)) == []


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_a_ray_meets_a_visible_shape_where_the_formula_says(shape, setting):
    """Infra-red rays and lidars see what is drawn."""
    assert list(mismatches(shape, setting, False, sights)) == []
