"""The boundingObjects of devices, and of parts that motors move."""

import pytest

from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.world_report import differences
from tests.tables import for_each
from tests.values.worlds import PHYSICS, STEP_MS, Setting, device, enable, robot

BODY = "boundingObject Box { size 0.2 0.2 0.2 }"
NOSE = "translation 0.3 0 0 boundingObject Box { size 0.1 0.1 0.1 }"
WALL = "Solid { translation 0.3 0 0.1 boundingObject Box { size 0.05 1 1 } }"
TURRET = """HingeJoint { jointParameters HingeJointParameters { axis 0 0 1 }
  device RotationalMotor { name "pan" } endPoint Solid { %s children [ TouchSensor { name "tip" %s } ] } }"""
WATCHER = robot(
    'DistanceSensor { name "eye" rotation 0 0 1 3.14159265 lookupTable [ 0 0 0 5 5 0 ] }',
    "translation 1 0 0.1",
    "watcher",
)
SOLIDS = sorted(name for name, kind in DEVICES.items() if kind.body and name != "Robot")


@pytest.mark.parametrize("physics", PHYSICS)
@for_each("type_name", SOLIDS)
def test_the_bounding_object_of_a_device_joins_that_of_its_robot(physics, type_name):
    """Each device with a frame is a Solid, so a lidar that stands out of its robot hits a wall in Webots."""
    nose = robot(f'{type_name} {{ name "nose" {NOSE} }}', f"translation 0 0 0.1 {BODY}")
    simulation = Setting(physics).load(nose + WATCHER)
    enable(simulation, 1)

    simulation.step(STEP_MS)

    assert device(simulation, "eye", 1).value == pytest.approx(0.65)


@pytest.mark.parametrize("physics", PHYSICS)
def test_a_bumper_that_a_motor_moves_is_listed_and_touches_nothing(physics):
    """Its shapes were a rigid part of the robot at their first pose, so it felt walls where it was not."""
    simulation = Setting(physics).load(robot(TURRET % ("", NOSE), BODY) + WALL)

    simulation.step(4 * STEP_MS)

    assert device(simulation, "tip").value is False
    assert "1 TouchSensor on a joint with a motor: collides with nothing" in differences(simulation)


def test_a_part_that_forces_move_collides():
    """MuJoCo moves a part with physics by forces, so nothing about it differs from Webots."""
    nodes = robot(TURRET % ("physics Physics { }", NOSE), BODY)

    lines = list(differences(Setting("mujoco").load(nodes)))

    assert not [line for line in lines if "collides with nothing" in line]
