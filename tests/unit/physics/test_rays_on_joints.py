"""Rays of sensors on a part that a joint moves: they turn with the part."""

import math

import pytest

from tests.tables import for_each
from tests.values.worlds import PHYSICS, STEP_MS, Setting, device, enable, robot

WALL = """Solid { translation 2 0 0 boundingObject Box { size 0.2 1 4 }
  children [ Shape { geometry Box { size 0.2 1 4 } } ] }"""
ARM = """HingeJoint { jointParameters HingeJointParameters { axis 0 0 1 }
  device RotationalMotor { name "pan" maxVelocity 100 }
  endPoint Solid { translation 0.1 0 0.5 children [
    DistanceSensor { name "generic" translation 0.1 0 0 lookupTable [ 0 0 0 5 5 0 ] }
    DistanceSensor { name "infrared" type "infra-red" translation 0.1 0 0 lookupTable [ 0 0 0 5 5 0 ] }
    Lidar { name "lidar" translation 0.1 0 0 numberOfLayers 1 horizontalResolution 1 fieldOfView 0.01
      maxRange 5 } ] } }
DistanceSensor { name "fixed" translation 0.2 0 0.5 lookupTable [ 0 0 0 5 5 0 ] }"""


@pytest.mark.parametrize("physics", PHYSICS)
@for_each("angle_rad", [0.0, 0.2, -0.1, 0.5 * math.pi])
def test_a_ray_points_where_its_joint_points(physics, angle_rad):
    """A sensor on a turret that measures ahead for ever trains a policy that never looks around."""
    simulation = Setting(physics).load(WALL + robot(ARM))
    enable(simulation)
    simulation.robots[0].motors["pan"].set_position(angle_rad)
    simulation.step(60 * STEP_MS)
    # The sensors are 0.2 m from the axis of the joint; the wall begins at x = 1.9 and ends at y = 0.5.
    away_m = 1.9 / math.cos(angle_rad) - 0.2 if angle_rad < 1.0 else math.inf

    found = [device(simulation, name).value for name in ("generic", "infrared", "fixed")]
    seen_m = device(simulation, "lidar").layers[0][0]

    assert found == pytest.approx([min(away_m, 5.0), min(away_m, 5.0), 1.7])
    assert seen_m == pytest.approx(away_m)
