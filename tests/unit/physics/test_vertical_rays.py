"""Rays that point straight down or up, as those of cliff sensors and of a lidar on a ceiling."""

import numpy as np
import pytest

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation

WORLD = """#VRML_SIM R2023b utf8
WorldInfo { basicTimeStep 16 }
Solid { translation 0 0 -0.05 name "floor"
  children [ Shape { geometry DEF FLOOR Box { size 20 20 0.1 } } ] boundingObject USE FLOOR }
Solid { translation 5 5 0.5 name "post"
  children [ Shape { geometry DEF POST Cylinder { radius 0.2 height 1 } } ] boundingObject USE POST }
Robot {
  children [
    DistanceSensor { name "sensor" translation 0.1 0 0.5 rotation 0 1 0 ANGLE type "laser"
      lookupTable [ 0 0 0, 5 5 0 ] }
    Lidar { translation 0 0 0.5 rotation 0 1 0 ANGLE fieldOfView 0.2 horizontalResolution 3
      numberOfLayers 1 minRange 0.05 maxRange 5 }
  ]
  name "r" controller "ros" controllerArgs [ "--name=rob" "--synchronize" ]
}
"""


@pytest.mark.parametrize("angle", ["1.5707963", "1.570796327", "1.57079632679", "1.5708"])
def test_a_ray_straight_down_meets_the_floor_and_no_post_elsewhere(physics, angle):
    """World files round a right angle differently, so a ray may tilt a little.

    It must still not meet a post several meters away.
    """
    simulation = Simulation.load(WORLD.replace("ANGLE", angle).encode(), physics(), "world", Mode.FAST)
    robot = simulation.robots[0]
    _, lidar = robot.parts.devices.rows["lidar"]
    lidar.enabled(16)

    simulation.step(16)

    assert robot.sensors["sensor"].value == pytest.approx(0.5, abs=1e-5)
    assert np.frombuffer(lidar.value, np.float32) == pytest.approx([0.5025, 0.5, 0.5025], abs=5e-3)


def test_a_ray_straight_up_meets_nothing(physics):
    """The ray meets no object, so the sensor measures its maximum range."""
    simulation = Simulation.load(WORLD.replace("ANGLE", "-1.5707963").encode(), physics(), "world", Mode.FAST)

    simulation.step(16)

    assert simulation.robots[0].sensors["sensor"].value == 5.0
