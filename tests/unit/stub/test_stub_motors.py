"""Motors: how commands are taken, over ROS and directly."""

import itertools
import math

import pytest

from palaestra_sim.scene.motors import Motor, MotorSpec

INF = math.inf


@pytest.fixture
def motor():
    """A motor of at most 10 rad/s."""
    return Motor(MotorSpec(name="m"))


def test_a_new_motor_holds_its_position(robot):
    """Target 0, velocity the maximum: as after each reset."""
    assert robot.get("wheel0_joint/get_target_position") == 0.0
    assert robot.get("wheel0_joint/get_velocity") == pytest.approx(137.46)


def test_get_velocity_returns_the_commanded_velocity(robot):
    """Not the measured speed: for that there are position sensors."""
    robot.call("wheel0_joint/set_position", value=INF)
    robot.call("wheel0_joint/set_velocity", value=5.0)

    assert robot.get("wheel0_joint/get_velocity") == 5.0
    assert robot.get("wheel0_joint/get_target_position") == INF


def test_infinity_travels(robot):
    """As float64 over ROS, in both directions."""
    assert robot.get("wheel0_joint/set_position", value=-INF) is True
    assert robot.get("wheel0_joint/get_target_position") == -INF


@pytest.mark.parametrize(("asked", "kept"), [(200.0, 137.46), (-200.0, -137.46), (INF, 137.46), (0.0, 0.0)])
def test_a_velocity_is_clamped_to_the_limit(robot, asked, kept):
    """With a warning in Webots, and success all the same."""
    robot.call("wheel0_joint/set_position", value=INF)

    assert robot.get("wheel0_joint/set_velocity", value=asked) is True
    assert robot.get("wheel0_joint/get_velocity") == pytest.approx(kept)


@pytest.mark.parametrize("service", ["set_velocity", "set_position", "set_acceleration"])
def test_nan_is_refused_and_answers_success(robot, service):
    """All setters answer success."""
    getter = {"set_position": "get_target_position"}.get(service, service.replace("set", "get"))
    before = robot.get(f"wheel0_joint/{getter}")

    assert robot.get(f"wheel0_joint/{service}", value=math.nan) is True
    assert robot.get(f"wheel0_joint/{getter}") == before


def test_a_negative_velocity_needs_an_infinite_target(robot):
    """The classic mistake: the robot turns only one way until set_position(inf)."""
    robot.call("wheel0_joint/set_velocity", value=-3.0)
    assert robot.get("wheel0_joint/get_velocity") == pytest.approx(137.46)

    robot.call("wheel0_joint/set_position", value=INF)
    robot.call("wheel0_joint/set_velocity", value=-3.0)

    assert robot.get("wheel0_joint/get_velocity") == -3.0


def test_a_motor_tells_what_the_world_file_says(robot):
    """Limits and names."""
    assert robot.get("wheel1_joint/get_max_velocity") == pytest.approx(137.46)
    assert robot.get("wheel1_joint/get_acceleration") == -1.0
    assert robot.get("wheel1_joint/get_max_torque") == 10.0
    assert robot.get("wheel1_joint/get_multiplier") == 1.0
    assert robot.get("wheel1_joint/get_min_position") == robot.get("wheel1_joint/get_max_position") == 0.0
    assert robot.get("wheel1_joint/get_type") == 0
    assert robot.get("wheel1_joint/get_name") == "wheel1_joint"
    assert robot.get("wheel1_joint/get_brake_name") == ""
    assert robot.get("wheel1_joint/get_position_sensor_name") == "wheel1_joint_sensor"


def test_available_torque_is_kept_within_the_limit(robot):
    """It changes nothing here, but is read back."""
    robot.call("wheel0_joint/set_available_torque", value=4.0)
    robot.call("wheel0_joint/set_available_torque", value=40.0)

    assert robot.get("wheel0_joint/get_available_torque") == 4.0


def test_torque_control_fails(robot):
    """The stub's wheels have speeds, no torques."""
    with pytest.raises(Exception, match="torques are not simulated; set a position or velocity"):
        robot.call("wheel0_joint/set_torque", value=1.0)
    assert robot.get("wheel0_joint/torque_feedback_sensor/enable", value=32) is False


def test_commands_take_effect_with_the_next_step(robot):
    """Until then the shaft is where it was."""
    sensor = robot.inbox("wheel0_joint_sensor/value")
    robot.call("wheel0_joint_sensor/enable", value=32)
    robot.call("robot/time_step", value=32)
    robot.call("wheel0_joint/set_position", value=INF)
    robot.call("wheel0_joint/set_velocity", value=1.0)

    for _ in range(2):
        robot.call("robot/time_step", value=32)

    assert sensor == pytest.approx([0.0, 0.032, 0.064])


def test_in_position_control_the_shaft_turns_to_its_target_and_stays(robot):
    """No faster than the commanded velocity."""
    sensor = robot.inbox("wheel0_joint_sensor/value")
    robot.call("wheel0_joint_sensor/enable", value=32)
    robot.call("wheel0_joint/set_velocity", value=2.0)
    robot.call("wheel0_joint/set_position", value=1.0)

    for _ in range(100):
        robot.call("robot/time_step", value=32)

    assert max(b - a for a, b in itertools.pairwise(sensor)) <= 2.0 * 0.032 + 1e-9
    assert sensor[-1] == pytest.approx(1.0, abs=1e-3)


def test_a_motor_accelerates_no_faster_than_its_limit(motor):
    """-1, the default, is without limit."""
    motor.set_position(INF)
    motor.set_velocity(4.0)
    assert motor.demand(0.1) == 4.0

    motor.set_acceleration(10.0)

    assert motor.demand(0.1) == 1.0


def test_positions_are_clamped_to_limits_that_differ():
    """Equal limits mean none."""
    motor = Motor(MotorSpec(name="m", min_rad=-1.0, max_rad=2.0))

    motor.set_position(5.0)
    assert motor.target_rad == 2.0
    motor.set_position(-INF)
    assert motor.target_rad == -INF


def test_a_reset_takes_every_command_back(motor):
    """Why a client sends set_position(inf) after each reset."""
    motor.set_position(INF)
    motor.set_velocity(-2.0)
    motor.set_acceleration(3.0)
    motor.angle_rad = 7.0

    motor.reset()

    assert (motor.target_rad, motor.velocity_rad_s, motor.acceleration_rad_s2) == (0.0, 10.0, -1.0)
    assert motor.angle_rad == 0.0


def test_a_motor_off_the_wheels_turns_too(ros, start, world, simple_robot):
    """A joint more, such as a turret: it moves nothing but its shaft."""
    turret = """HingeJoint { device [ RotationalMotor { name "turret" } PositionSensor { name "angle" } ] }"""
    start(world(robot=simple_robot.replace("DEF IR", f"{turret} DEF IR")))
    robot = ros.node("robotino")
    angles = robot.inbox("angle/value")
    robot.call("angle/enable", value=32)
    robot.call("turret/set_position", value=INF)
    robot.call("turret/set_velocity", value=2.0)

    robot.call("robot/time_step", value=320)

    assert angles == pytest.approx([0.64])
