"""The boundingObjects that collide as in Webots, and the lines about those that do not."""

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


@for_each(
    "geometry, lines",
    [
        ("Box { size 1 1 1 }", []),
        ("Cylinder { radius 0.2 height 1 }", []),
        ("Sphere { radius 0.2 }", ["1 Sphere"]),
        ("Capsule { radius 0.2 height 1 }", ["1 Capsule"]),
        ("Pose { rotation 1 0 0 1.5707963 children Cylinder { radius 0.2 height 1 } }", ["1 Cylinder"]),
        ("Group { children [ Box { } Sphere { } Sphere { } ] }", ["2 Sphere"]),
    ],
)
def test_an_obstacle_with_the_outline_of_its_widest_height_is_listed(geometry, lines):
    """In the stub a low robot touches a ball at the ball's full width, so distances differ from Webots."""
    obstacle = f"Solid {{ translation 2 0 0.5 boundingObject {geometry} }}"
    listed, exact = (
        [line for line in differences(Setting(physics).load(obstacle + robot(""))) if "from above" in line]
        for physics in ("stub", "mujoco")
    )

    touched = "as boundingObject: robots touch its outline from above, at each height"
    assert listed == [f"{line} {touched}" for line in lines]
    assert exact == []


@for_each(
    "fields, lines",
    [
        ("boundingObject Cylinder { radius 0.2 height 1 }", []),
        (BODY, ['robot "r": upright cylinders collide in place of 1 Box']),
        (
            "boundingObject Sphere { radius 0.2 }",
            ['robot "r": upright cylinders collide in place of 1 Sphere'],
        ),
    ],
)
def test_a_robot_that_collides_as_upright_cylinders_is_listed(fields, lines):
    """The corners of a box are round in the stub, so a robot passes corners that stop it in Webots."""
    listed, exact = (
        [line for line in differences(Setting(physics).load(robot("", fields))) if "upright" in line]
        for physics in ("stub", "mujoco")
    )

    assert listed == lines
    assert exact == []
