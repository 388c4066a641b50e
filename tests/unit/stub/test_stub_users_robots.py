"""Robots of users' worlds drive by the radius and track of their wheels; other joints keep to their stops."""

import math

import pytest

from palaestra_sim.errors import WorldError
from tests.unit.stub.users_worlds import load_world

ARM = """Robot { name "arm" children [ HingeJoint {
  jointParameters HingeJointParameters { axis 0 0 1 position 0.5 minStop -1 maxStop 1 }
  device [ RotationalMotor { name "m" } PositionSensor { name "s" } ]
  endPoint Solid { translation 1 0 0 children [
    DistanceSensor { name "eye" lookupTable [ 0 0 0, 9 9 0 ] }
    SliderJoint { endPoint DEF TIP Solid { translation 1 0 0 } } ] } } ] }"""

THREE_WHEELS = """Robot { children [
  Robotino3Wheel { } Robotino3Wheel { number 1 } Robotino3Wheel { number 2 }
  Robotino3Platform { translation 0 0 0.28 extension [ GPS { } ] } ]
  boundingObject Cylinder { radius 0.2 height 0.2 } physics Physics { } }"""


def drive(simulation, seconds, **speeds):
    """Turn the motors of the only robot at these speeds in rad/s, and return the robot's new position."""
    (robot,) = simulation.robots
    for name, motor in robot.motors.items():
        if name.replace(" ", "_") in speeds:
            motor.set_position(math.inf)
            motor.set_velocity(speeds[name.replace(" ", "_")])
    simulation.step(round(seconds * 1000 / 16) * 16)
    return robot.body


def test_a_robot_of_webots_stands_still_unless_a_client_drives_it():
    """The robot's own controller does not run here.

    With controller ros, a client would use motors that are missing.
    """
    (shape,) = load_world('Nao { translation 1 0 0.3 controller "soccer" }').scene.solids
    assert shape.pose.position[:2] == (1.0, 0.0)

    with pytest.raises(WorldError, match="the stub simulates no Nao"):
        load_world('Nao { controller "ros" controllerArgs [ "--name=nao" "--synchronize" ] }')


@pytest.mark.parametrize(
    ("robot", "left", "right", "radius", "track"),
    [
        ("E-puck", ["left_wheel_motor"], ["right_wheel_motor"], 0.02, 0.052),
        ("Pioneer3dx", ["left_wheel"], ["right_wheel"], 0.0975, 0.3314),
        ("TurtleBot3Burger", ["left_wheel_motor"], ["right_wheel_motor"], 0.033, 0.16),
        (
            "Pioneer3at",
            ["front_left_wheel", "back_left_wheel"],
            ["front_right_wheel", "back_right_wheel"],
            0.11,
            0.394,
        ),
        (
            "Rosbot",
            ["front_left_wheel_motor", "rear_left_wheel_motor"],
            ["front_right_wheel_motor", "rear_right_wheel_motor"],
            0.0425,
            0.192,
        ),
        (
            "RosbotXl",
            ["fl_wheel_joint", "rl_wheel_joint"],
            ["fr_wheel_joint", "rr_wheel_joint"],
            0.05,
            0.27,
        ),
        (
            "Moose",
            [f"left_motor_{number}" for number in range(1, 5)],
            [f"right_motor_{number}" for number in range(1, 5)],
            0.3175,
            1.2498,
        ),
    ],
)
def test_robots_of_webots_drive_by_their_wheels(robot, left, right, radius, track):
    """The motion follows from the radius of the wheels and from the distance between them."""
    world = f'{robot} {{ controller "ros" controllerArgs [ "--name=r" "--synchronize" ] }}'
    straight = drive(load_world(world), 0.8, **dict.fromkeys([*left, *right], 1.0))
    assert straight.x == pytest.approx(0.8 * radius, rel=0.02)
    assert straight.y == pytest.approx(0.0, abs=1e-6)

    speeds = {**dict.fromkeys(left, -1.0), **dict.fromkeys(right, 1.0)}
    turned = drive(load_world(world), 0.8, **speeds)
    assert turned.heading_rad == pytest.approx(0.8 * 2.0 * radius / track, rel=0.02)


@pytest.mark.parametrize("robot", ["Robotino3 { }", THREE_WHEELS])
def test_a_robotino_of_webots_drives_as_the_one_of_the_arena(robot):
    """The PROTO's wheels have a radius of 0.063 m and are 120 degrees apart.

    Published variants of the robot consist of three `Robotino3Wheel`.
    """
    body = drive(load_world(robot), 0.8, wheel0_joint=0.0, wheel1_joint=-1.0, wheel2_joint=1.0)

    assert body.x == pytest.approx(0.8 * 0.063 / math.sqrt(0.75), rel=0.01)


def test_a_robot_that_no_client_reaches_needs_no_device_of_the_table():
    """The robot's own controller does not run here, so the robot is only an obstacle."""
    statue = 'Robot { controller "patrol" children [ Radar { } ] boundingObject Box { size 1 1 1 } }'

    assert load_world(statue).robots[0].body.radius > 0.4


def test_a_lidar_of_webots_can_be_mounted_on_any_robot():
    """The lidar's PROTO is bundled, with the rays of the real device."""
    robot = 'Robot { controller "ros" controllerArgs [ "--name=r" "--synchronize" ] children [ Sick { } ] }'
    (found,) = load_world(robot.replace("Sick", "SickLms291")).robots

    (lidar,) = found.parts.devices.rows.values()
    assert lidar[1].info["horizontalResolution"] == 180


def test_a_joint_begins_at_its_position_and_ends_at_its_stop():
    """The pose of a joint's end in a world file belongs to the joint's `position`, which is 0.5 here."""
    simulation = load_world(ARM)
    (robot,) = simulation.robots
    tip = simulation.tree.of_def("TIP")
    assert tip.place.world_position == pytest.approx((2.0, 0.0, 0.0))

    robot.motors["m"].set_position(3.0)
    simulation.step(1600)

    assert robot.sensors["s"].value == 1.0
    assert tip.place.world_position == pytest.approx((2 * math.cos(0.5), 2 * math.sin(0.5), 0.0))

    simulation.reset()
    simulation.step(16)
    assert tip.place.world_position == pytest.approx((2.0, 0.0, 0.0))
