"""Joints with motors, brakes and sensors, and devices that only store their settings."""

import math

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros.node import ServiceFailed
from tests.scenes import load_scene

STEP_MS = 32
LIFT = """SliderJoint { jointParameters JointParameters { axis 0 0 1 minStop 0 maxStop 0.2 }
  device [ PositionSensor { name "height" } Brake { name "grip" } LinearMotor { name "lift" maxForce 20 } ]
  endPoint Solid { children [ GPS { name "top" } ] } }"""
WRIST = """HingeJoint { device [
  RotationalMotor { name "wrist" maxTorque 6 } Brake { name "band" } PositionSensor { name "turn" } ]
  endPoint Solid { physics Physics { } } }"""
CAMERA = """Camera { name "eye" width 320 height 200 focus Focus { focalDistance 1 maxFocalDistance 2 }
  zoom Zoom { minFieldOfView 0.2 maxFieldOfView 1.2 } recognition Recognition { segmentation TRUE } }"""


@pytest.fixture
def load(world, simple_robot):
    """`load(part)` returns the simulation of a robot with that part."""
    return lambda part: load_scene(world(robot=simple_robot.replace("DEF IR", f"{part} DEF IR")))


@pytest.fixture
def robot_with(start, world, simple_robot, ros):
    """`robot_with(part)` returns the node of a robot with that part."""

    def begin(part):
        start(world(robot=simple_robot.replace("DEF IR", f"{part} DEF IR")))
        return ros.node("robotino")

    return begin


def test_a_linear_motor_lifts_what_is_on_its_slider_as_far_as_the_stop(load):
    """The motor moves at 0.1 m/s for 0.32 s, and then continues to its stop at 0.2 m."""
    simulation = load(LIFT)
    (robot,) = simulation.robots
    start = robot.sensors["top"]
    simulation.step(STEP_MS)
    low = start.value[2]
    robot.motors["lift"].set_position(math.inf)
    robot.motors["lift"].set_velocity(0.1)

    simulation.step(10 * STEP_MS)
    assert robot.sensors["height"].value == pytest.approx(0.032)
    assert robot.sensors["top"].value[2] - low == pytest.approx(0.032)
    simulation.step(100 * STEP_MS)
    assert robot.sensors["height"].value == pytest.approx(0.2)


def test_a_linear_motor_has_services_for_force_and_none_for_torque(robot_with):
    """A linear motor has services for force instead of torque; its `get_type` returns 1."""
    robot = robot_with(LIFT)

    assert robot.get("lift/get_type") == 1
    assert robot.get("lift/get_max_force") == 20.0
    assert robot.get("lift/force_feedback_sensor/get_sampling_period") == 0
    assert robot.get("lift/force_feedback_sensor/enable", value=32) is False
    assert "lift/set_torque" not in robot.services


def test_the_devices_of_a_joint_know_each_other_by_name(robot_with):
    """The order of the devices in the world does not matter; "" means that the joint has no such device."""
    robot = robot_with(LIFT)

    assert robot.get("lift/get_brake_name") == "grip"
    assert robot.get("lift/get_position_sensor_name") == "height"
    assert robot.get("grip/get_motor_name") == "lift"
    assert robot.get("grip/get_position_sensor_name") == "height"
    assert robot.get("height/get_motor_name") == "lift"
    assert robot.get("height/get_brake_name") == "grip"
    assert robot.get("grip/get_type") == robot.get("height/get_type") == 1
    assert robot.get("wheel0_joint/get_brake_name") == ""
    assert robot.get("wheel0_joint_sensor/get_type") == 0


def test_a_brake_limits_the_speed_that_a_motor_reaches(robot_with):
    """With 3 N m s/rad, the brake balances the motor's 6 N m at 2 rad/s.

    Without damping, the motor turns at 5 rad/s again.
    """
    robot = robot_with(WRIST)
    angles = robot.inbox("turn/value")
    robot.call("turn/enable", value=STEP_MS)
    robot.call("wrist/set_position", value=math.inf)
    robot.call("wrist/set_velocity", value=5.0)

    robot.call("robot/time_step", value=STEP_MS)
    for constant in (3.0, 0.0, -1.0):
        assert robot.get("band/set_damping_constant", value=constant) is True
        robot.call("robot/time_step", value=STEP_MS)

    speeds = [(after - before) / 0.032 for before, after in zip([0.0, *angles], angles, strict=False)]
    assert speeds == pytest.approx([5.0, 2.0, 5.0, 5.0])


def test_a_brake_slows_a_driven_wheel(load):
    """Motors of wheels move the whole body, but the brake limits their speed too."""
    simulation = load("")
    (robot,) = simulation.robots
    for motor in robot.motors.values():
        motor.set_position(math.inf)
        motor.set_velocity(5.0)
        motor.set_damping(motor.available_torque_nm)

    simulation.step(50 * STEP_MS)

    assert [motor.speed_rad_s for motor in robot.motors.values()] == pytest.approx([1.0] * 3)


def test_an_led_keeps_its_state(robot_with):
    """A program reads the state of the LED, although nobody sees its light."""
    robot = robot_with('LED { name "lamp" color [ 1 0 0, 0 1 0 ] }')

    assert robot.get("lamp/get_led") == 0
    assert robot.get("lamp/set_led", value=2) is True
    assert robot.get("lamp/get_led") == 2
    assert "lamp/enable" not in robot.services


def test_a_camera_answers_its_settings_and_fails_to_see(robot_with):
    """If `enable` succeeded, a client would wait for images for ever."""
    robot = robot_with(CAMERA)

    info = robot.call("eye/get_info")
    assert (info.width, info.height, info.Fov) == (320, 200, 0.7854)
    assert robot.get("eye/enable", value=32) is False
    assert robot.get("eye/enable", value=0) is True
    assert robot.get("eye/get_sampling_period") == 0
    assert robot.get("eye/save_image", filename="eye.png", quality=90) == 0
    assert robot.get("eye/has_recognition") is True
    assert robot.get("eye/recognition_has_segmentation") is True
    assert robot.get("eye/recognition_enable", value=32) is False


def test_a_camera_zooms_and_focuses_within_its_limits(robot_with):
    """As in the real controller, each call succeeds, but a value beyond the limits changes nothing."""
    robot = robot_with(CAMERA)

    for fov in (1.0, 1.3):
        assert robot.get("eye/set_fov", value=fov) is True
    for distance in (1.5, 2.5):
        assert robot.get("eye/set_focal_distance", value=distance) is True
    assert robot.get("eye/set_exposure", value=2.0) is True

    assert robot.call("eye/get_info").Fov == 1.0
    assert robot.call("eye/get_zoom_info").maxFov == 1.2
    assert robot.call("eye/get_focus_info").focalDistance == 1.5
    assert robot.get("eye/get_exposure") == 2.0


def test_a_camera_without_zoom_and_focus_stays_as_it_is(robot_with):
    """A write must not give the camera a zoom or a focus that its world does not have."""
    robot = robot_with('Camera { name "eye" }')

    robot.call("eye/set_fov", value=1.0)
    robot.call("eye/set_focal_distance", value=1.0)

    assert robot.call("eye/get_info").Fov == robot.call("eye/get_zoom_info").minFov == 0.7854
    assert robot.call("eye/get_focus_info").focalDistance == 0.0
    assert "eye/recognition_enable" not in robot.services


def test_a_range_finder_answers_its_settings_alone(robot_with):
    """The stub renders no depth images, so `enable` fails, but a client can read the settings."""
    robot = robot_with('RangeFinder { name "it" maxRange 3 }')
    answer = robot.call("it/get_info")

    assert (answer.maxRange, answer.width) == (3.0, 64)
    assert robot.get("it/enable", value=32) is False


def test_a_skin_has_no_bones_and_whatever_needs_one_fails(robot_with):
    """The stub loads no meshes, so a skin has no bones. Webots itself crashes at an unknown bone."""
    robot = robot_with('Skin { name "anna" }')

    assert robot.get("anna/get_bone_count") == 0
    assert robot.call("anna/set_bone_position", index=0).success == 0
    assert robot.call("anna/set_bone_orientation", index=0).success == 0
    with pytest.raises(ServiceFailed, match="anna has no bone 3, because this simulator does not load"):
        robot.call("anna/get_bone_name", index=3)


TANK = """Robot { name "tank" controller "ros" controllerArgs [ "--name=tank" "--synchronize" ] children [
  Track { translation 0 0.2 0.05 device [ LinearMotor { name "left" } PositionSensor { name "run" } ]
    children [ TrackWheel { position -0.1 0 radius 0.05 } Shape { } ]
    boundingObject Box { size 0.3 0.05 0.1 } }
  Track { translation 0 -0.2 0.05 device [ LinearMotor { name "right" } ]
    boundingObject Box { size 0.3 0.05 0.1 } } ] boundingObject Box { size 0.3 0.3 0.05 } }"""


def test_two_tracks_drive_a_robot_as_two_wheels_do(world):
    """A belt without slip moves its side of the robot by the distance that its motor turns."""
    (robot,) = (simulation := load_scene(world(robot=TANK))).robots
    for name, speed in (("left", 0.1), ("right", 0.2)):
        robot.motors[name].set_position(math.inf)
        robot.motors[name].set_velocity(speed)
    simulation.step(31 * STEP_MS)

    elapsed = 31 * STEP_MS / 1000.0
    assert robot.body.heading_rad == pytest.approx(0.1 / 0.4 * elapsed, rel=0.05)
    assert math.hypot(robot.body.x, robot.body.y) == pytest.approx(0.15 * elapsed, rel=0.05)
    assert robot.sensors["run"].value == pytest.approx(0.1 * elapsed, rel=0.05)


def test_a_track_without_a_motor_is_a_fixed_part_of_its_robot(world):
    """The boundingObject of the track counts as an obstacle; wheels and belt are only visual."""
    (robot,) = load_scene(world(robot=TANK.replace("LinearMotor", "Brake"))).robots

    assert robot.body.base.drive is None
    assert robot.body.radius > 0.2


def test_what_is_at_the_end_of_a_joint_is_refused_if_it_is_unknown(load):
    """Without the error, a gripper of an unknown type would be missing and nobody would notice."""
    with pytest.raises(WorldError, match="the stub simulates no Minotaur on a robot"):
        load("HingeJoint { endPoint Minotaur { } }")
    with pytest.raises(WorldError, match="the stub simulates no Minotaur on a robot"):
        load("BallJoint { endPoint Minotaur { } }")

    load("HingeJoint { endPoint SolidReference { } }")


def test_a_sensor_on_a_caster_is_one_of_the_robot_s(load):
    """A joint without a motor is fixed, so its sensor is a sensor of the robot."""
    (robot,) = load('BallJoint { endPoint Solid { children [ GPS { name "low" } ] } }').robots

    assert "low" in robot.sensors
