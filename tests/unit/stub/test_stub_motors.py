"""Motors and the effects of their commands, over ROS and without ROS."""

import itertools
import math

import pytest

from palaestra_sim.scene.motors import Motor, MotorSpec

INF = math.inf


@pytest.fixture
def motor():
    """Return a motor with a velocity limit of 10 rad/s."""
    return Motor(MotorSpec(name="m"))


def test_a_new_motor_holds_its_position(robot):
    """As after a reset, the target is 0 and the velocity is the maximum."""
    assert robot.get("wheel0_joint/get_target_position") == 0.0
    assert robot.get("wheel0_joint/get_velocity") == pytest.approx(137.46)


def test_get_velocity_returns_the_commanded_velocity(robot):
    """A client reads the real speed from the position sensors."""
    robot.call("wheel0_joint/set_position", value=INF)
    robot.call("wheel0_joint/set_velocity", value=5.0)

    assert robot.get("wheel0_joint/get_velocity") == 5.0
    assert robot.get("wheel0_joint/get_target_position") == INF


def test_infinity_travels(robot):
    """ROS messages of both directions have float64, which can be infinite."""
    assert robot.get("wheel0_joint/set_position", value=-INF) is True
    assert robot.get("wheel0_joint/get_target_position") == -INF


@pytest.mark.parametrize(("asked", "kept"), [(200.0, 137.46), (-200.0, -137.46), (INF, 137.46), (0.0, 0.0)])
def test_a_velocity_is_clamped_to_the_limit(robot, asked, kept):
    """As in Webots, a warning is logged, but the call succeeds."""
    robot.call("wheel0_joint/set_position", value=INF)

    assert robot.get("wheel0_joint/set_velocity", value=asked) is True
    assert robot.get("wheel0_joint/get_velocity") == pytest.approx(kept)


@pytest.mark.parametrize("service", ["set_velocity", "set_position", "set_acceleration"])
def test_nan_is_refused_and_answers_success(robot, service):
    """As in Webots, the call of each setter succeeds, but NaN is not stored."""
    getter = {"set_position": "get_target_position"}.get(service, service.replace("set", "get"))
    before = robot.get(f"wheel0_joint/{getter}")

    assert robot.get(f"wheel0_joint/{service}", value=math.nan) is True
    assert robot.get(f"wheel0_joint/{getter}") == before


def test_a_negative_velocity_needs_an_infinite_target(robot):
    """A client that forgets `set_position(inf)` sees its robot turn only one way. The mistake is common."""
    robot.call("wheel0_joint/set_velocity", value=-3.0)
    assert robot.get("wheel0_joint/get_velocity") == pytest.approx(137.46)

    robot.call("wheel0_joint/set_position", value=INF)
    robot.call("wheel0_joint/set_velocity", value=-3.0)

    assert robot.get("wheel0_joint/get_velocity") == -3.0


def test_a_motor_tells_what_the_world_file_says(robot):
    """A client has no world file, so it reads limits and names from the motor."""
    assert robot.get("wheel1_joint/get_max_velocity") == pytest.approx(137.46)
    assert robot.get("wheel1_joint/get_acceleration") == -1.0
    assert robot.get("wheel1_joint/get_max_torque") == 10.0
    assert robot.get("wheel1_joint/get_multiplier") == 1.0
    assert robot.get("wheel1_joint/get_min_position") == robot.get("wheel1_joint/get_max_position") == 0.0
    assert robot.get("wheel1_joint/get_type") == 0
    assert robot.get("wheel1_joint/get_name") == "wheel1_joint"
    assert robot.get("wheel1_joint/get_brake_name") == ""
    assert robot.get("wheel1_joint/get_position_sensor_name") == "wheel1_joint_sensor"


@pytest.mark.parametrize(("asked", "kept"), [(0.0, 0.0), (40.0, 10.0), (-1.0, 10.0), (math.nan, 10.0)])
def test_available_torque_is_kept_within_the_limit(robot, asked, kept):
    """The call succeeds for every value, even for a value that Webots ignores."""
    assert robot.get("wheel0_joint/set_available_torque", value=asked) is True
    assert robot.get("wheel0_joint/get_available_torque") == kept


def test_a_part_of_the_torque_of_a_wheel_is_refused(robot):
    """The stub has no masses, so it cannot compute how a robot drives with less torque."""
    with pytest.raises(
        Exception, match="'wheel0_joint' cannot use a part of its torque in this simulator; set 0, or"
    ):
        robot.call("wheel0_joint/set_available_torque", value=4.0)


def test_a_motor_without_torque_drives_nothing(robot):
    """A program that switches off its motors expects that the robot stays."""
    sensor = robot.inbox("wheel0_joint_sensor/value")
    robot.call("wheel0_joint_sensor/enable", value=32)
    for wheel in ("wheel0_joint", "wheel1_joint", "wheel2_joint"):
        robot.call(f"{wheel}/set_available_torque", value=0.0)
        robot.call(f"{wheel}/set_position", value=INF)
        robot.call(f"{wheel}/set_velocity", value=4.0)

    robot.call("robot/time_step", value=320)

    assert sensor == [0.0]


def test_torque_control_fails(robot):
    """In the stub, wheels have speeds but no torques."""
    with pytest.raises(Exception, match="torques are not simulated; set a position or velocity"):
        robot.call("wheel0_joint/set_torque", value=1.0)
    assert robot.get("wheel0_joint/torque_feedback_sensor/enable", value=32) is False


def test_commands_take_effect_with_the_next_step(robot):
    """No time passes between two steps, so the shaft keeps its position until the next step."""
    sensor = robot.inbox("wheel0_joint_sensor/value")
    robot.call("wheel0_joint_sensor/enable", value=32)
    robot.call("robot/time_step", value=32)
    robot.call("wheel0_joint/set_position", value=INF)
    robot.call("wheel0_joint/set_velocity", value=1.0)

    for _ in range(2):
        robot.call("robot/time_step", value=32)

    assert sensor == pytest.approx([0.0, 0.032, 0.064])


def test_in_position_control_the_shaft_turns_to_its_target_and_stays(robot):
    """The shaft turns at most with the commanded velocity."""
    sensor = robot.inbox("wheel0_joint_sensor/value")
    robot.call("wheel0_joint_sensor/enable", value=32)
    robot.call("wheel0_joint/set_velocity", value=2.0)
    robot.call("wheel0_joint/set_position", value=1.0)

    for _ in range(100):
        robot.call("robot/time_step", value=32)

    assert max(b - a for a, b in itertools.pairwise(sensor)) <= 2.0 * 0.032 + 1e-9
    assert sensor[-1] == pytest.approx(1.0, abs=1e-3)


def test_a_motor_accelerates_no_faster_than_its_limit(motor):
    """The default limit of -1 means no limit."""
    motor.set_position(INF)
    motor.set_velocity(4.0)
    assert motor.demand(0.1) == 4.0

    motor.set_acceleration(10.0)

    assert motor.demand(0.1) == 1.0


def test_positions_are_clamped_to_limits_that_differ():
    """Equal limits, as in the default 0 and 0, mean no limits."""
    motor = Motor(MotorSpec(name="m", min_rad=-1.0, max_rad=2.0))

    motor.set_position(5.0)
    assert motor.target_rad == 2.0
    motor.set_position(-INF)
    assert motor.target_rad == -INF


def positions(motor, steps, step_s=0.008):
    """Return the motor's position after each of some steps."""
    found = []
    for _ in range(steps):
        motor.advance(step_s)
        found.append(motor.angle_rad)
    return found


def test_the_gains_of_the_controller_decide_how_a_target_is_reached(motor):
    """With a proportional gain of 1 the shaft covers 63 % in a second.

    With the default of 10 it reaches the target.
    """
    motor.set_control_pid(1.0, 0.0, 0.0)
    motor.set_position(1.0)

    assert positions(motor, 125)[-1] == pytest.approx(1.0 - (1.0 - 0.008) ** 125)


def test_the_controller_integrates_and_differentiates_the_error(motor):
    """As in Webots, integral and derivative change at each basic step after the gains were set."""
    motor.set_control_pid(1.0, 2.0, 0.001)
    motor.set_position(0.5)

    first, second = positions(motor, 2, step_s=0.1)

    speed = 0.5 + 2.0 * 0.05 + 0.001 * 5.0
    assert first == pytest.approx(0.1 * speed)
    error = 0.5 - first
    speed = error + 2.0 * (0.05 + 0.1 * error) + 0.001 * (error - 0.5) / 0.1
    assert second == pytest.approx(first + 0.1 * speed)


@pytest.mark.parametrize("gains", [(0.0, 0.0, 0.0), (1.0, -1.0, 0.0), (1.0, 0.0, -1.0), (math.nan, 0.0, 0.0)])
def test_gains_that_webots_refuses_change_nothing(motor, gains):
    """One wrong gain makes the whole call ineffective, so the motor keeps all three gains."""
    motor.set_control_pid(*gains)

    assert motor.gains == (10.0, 0.0, 0.0)


def test_a_multiplier_scales_positions_velocities_and_torques():
    """The program reads the value that it set, while the shaft moves by the value times the multiplier."""
    motor = Motor(MotorSpec(name="m", multiplier=-0.5, max_velocity_rad_s=2.0))

    motor.set_position(1.0)
    motor.set_velocity(3.0)
    motor.set_effort(8.0)

    assert (motor.asked_rad, motor.asked_velocity_rad_s) == (1.0, 3.0)
    assert (motor.target_rad, motor.velocity_rad_s, motor.effort_nm) == (-0.5, -1.5, -4.0)
    motor.set_position(INF)
    motor.set_velocity(5.0)
    assert (motor.target_rad, motor.velocity_rad_s, motor.asked_velocity_rad_s) == (INF, -2.0, 4.0)


def test_a_joint_without_physics_accelerates_by_its_torque_and_keeps_its_velocity_to_the_target():
    """Webots accelerates such a joint with 10 rad/s2, then keeps the velocity, and stops at the target."""
    motor = Motor(MotorSpec(name="m", max_velocity_rad_s=2.0))
    motor.kinematic = True
    motor.set_position(1.0)

    course = positions(motor, 10, step_s=0.1)

    assert course == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert motor.speed_rad_s == 0.0


@pytest.mark.parametrize(("acceleration", "speed"), [(-1.0, 1.0), (4.0, 0.4), (40.0, 1.0)])
def test_the_acceleration_of_a_joint_without_physics_is_at_most_its_torque(acceleration, speed):
    """The manual of Webots calls this the kinematics mode."""
    motor = Motor(MotorSpec(name="m", acceleration_rad_s2=acceleration))
    motor.kinematic = True
    motor.set_position(INF)

    motor.advance(0.1)

    assert motor.speed_rad_s == pytest.approx(speed)


def test_an_endless_motion_of_a_joint_without_physics_ends_at_its_limit():
    """Without physics, the limit of the target position also limits the motion."""
    motor = Motor(MotorSpec(name="m", max_torque_nm=100.0, min_rad=-1.0, max_rad=1.0))
    motor.kinematic = True
    motor.set_position(INF)

    assert positions(motor, 3, step_s=0.1) == pytest.approx([1.0, 1.0, 1.0])


def test_a_robot_without_physics_accelerates_as_its_wheels_do(ros, start, world, simple_robot):
    """With 10 rad/s2, wheels without physics need 0.4 s for 4 rad/s; with physics they reach this at once."""
    start(world(robot=simple_robot.replace("physics Physics { }", "")))
    robot = ros.node("robotino")
    sensor = robot.inbox("wheel0_joint_sensor/value")
    robot.call("wheel0_joint_sensor/enable", value=32)
    for wheel in ("wheel0_joint", "wheel1_joint", "wheel2_joint"):
        robot.call(f"{wheel}/set_position", value=INF)
        robot.call(f"{wheel}/set_velocity", value=4.0)

    for _ in range(20):
        robot.call("robot/time_step", value=32)

    speeds = [(after - before) / 0.032 for before, after in itertools.pairwise([0.0, *sensor])]
    assert speeds == pytest.approx([min(4.0, 0.32 * step) for step in range(1, 21)])


def test_a_reset_takes_every_command_back(motor):
    """A client must send `set_position(inf)` after each reset."""
    motor.set_position(INF)
    motor.set_velocity(-2.0)
    motor.set_acceleration(3.0)
    motor.angle_rad = 7.0

    motor.reset()

    assert (motor.target_rad, motor.velocity_rad_s, motor.acceleration_rad_s2) == (0.0, 10.0, -1.0)
    assert motor.angle_rad == 0.0


def test_a_motor_off_the_wheels_turns_too(ros, start, world, simple_robot):
    """The motor of a turret moves only its own shaft, not the robot."""
    turret = """HingeJoint { device [ RotationalMotor { name "turret" } PositionSensor { name "angle" } ]
      endPoint Solid { physics Physics { } } }"""
    start(world(robot=simple_robot.replace("DEF IR", f"{turret} DEF IR")))
    robot = ros.node("robotino")
    angles = robot.inbox("angle/value")
    robot.call("angle/enable", value=32)
    robot.call("turret/set_position", value=INF)
    robot.call("turret/set_velocity", value=2.0)

    robot.call("robot/time_step", value=320)

    assert angles == pytest.approx([0.64])
