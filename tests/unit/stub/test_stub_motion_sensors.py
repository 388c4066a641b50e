"""Compass, gyro, accelerometer and similar sensors, on a robot that stands, drives or turns."""

import math

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.joints import Joint, JointFrame
from palaestra_sim.scene.motion import motion_of
from palaestra_sim.scene.motors import Motor, MotorSpec
from tests.scenes import load_scene
from tests.unit.stub.sensors_in_motion import NORTH, ON_A_TURNTABLE, STEP_MS, draws, drive, value_of


def test_a_place_on_a_slider_moves_along_its_axis():
    """The slider's axis is x of its joint, which is turned by 90 degrees, so the place moves along y."""
    frame = Frame(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, math.pi / 2.0))
    motor = Motor(MotorSpec(name="lift"))
    motor.speed_rad_s = 0.2
    end = JointFrame(
        frame, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), Joint(axis=(1.0, 0.0, 0.0), slides=True, motor=motor)
    )

    motion = motion_of(Frame(end, (1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.0)), body=None)

    assert motion.velocity == pytest.approx((0.0, 0.2, 0.0))
    assert motion.turning == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("robot", "mount", "north"),
    [
        ("", "", (0.0, 1.0, 0.0)),
        (NORTH, "", (1.0, 0.0, 0.0)),
        (NORTH, NORTH, (0.0, -1.0, 0.0)),
        ("", "rotation 1 0 0 1.5707963267948966", (0.0, 0.0, -1.0)),
    ],
)
def test_a_compass_shows_north_in_its_own_frame(load_with, robot, mount, north):
    """North is +y of the world, and the rotation of the robot and of the mount turn the sensor."""
    simulation = load_with(f"Compass {{ {mount} }}", robot)

    simulation.step(STEP_MS)

    assert value_of(simulation, "compass") == pytest.approx(north)


def test_a_compass_turns_against_its_robot(load_with):
    """The manual of Webots computes the bearing as atan2 of the first two values."""
    simulation = load_with("Compass { }")

    drive(simulation, 0.0, 0.0, 0.5)

    heading_rad = simulation.robots[0].body.heading_rad
    assert heading_rad > 0.1
    assert value_of(simulation, "compass") == pytest.approx(
        (math.sin(heading_rad), math.cos(heading_rad), 0.0)
    )


def test_axes_go_through_table_and_resolution_and_one_that_is_off_is_nan(load_with):
    """The order is that of Webots: first the table, then the resolution."""
    simulation = load_with("Compass { lookupTable [ -1 -100 0, 1 100 0 ] resolution 30 zAxis FALSE }", NORTH)

    simulation.step(STEP_MS)

    x, y, z = value_of(simulation, "compass")
    assert (x, y) == pytest.approx((90.0, 0.0))
    assert math.isnan(z)


def test_each_axis_of_a_noisy_table_draws_its_own_noise(load_with):
    """An axis that is switched off draws no random number, so z gets the second number."""
    simulation = load_with(
        "Compass { lookupTable [ -1 0 0.5, 1 100 0.5 ] yAxis FALSE }", "rotation 0 0 1 0.5"
    )
    first, third = draws(2)

    simulation.step(STEP_MS)

    x, y, z = value_of(simulation, "compass")
    assert x == pytest.approx(50.0 * (1.0 + math.sin(0.5)) * (1.0 + 0.5 * first))
    assert math.isnan(y)
    assert z == pytest.approx(50.0 * (1.0 + 0.5 * third))


def test_a_sensor_without_a_table_answers_an_empty_one(node_with):
    """A client must not take a missing table, which is the default, for an error."""
    assert node_with("Compass { }").get("compass/get_lookup_table") == ()


def test_a_sensor_answers_its_table(node_with):
    """ROS has no lists of lists, so the response has the rows one after the other, in one list."""
    node = node_with("Compass { lookupTable [ -1 -100 0, 1 100 0.5 ] }")

    assert node.get("compass/get_lookup_table") == (-1.0, -100.0, 0.0, 1.0, 100.0, 0.5)


def test_a_table_whose_inputs_do_not_grow_is_refused(load_with):
    """No value could be interpolated between such rows."""
    with pytest.raises(WorldError, match="the inputs of lookupTable do not increase; sort its rows"):
        load_with("Compass { lookupTable [ 1 1 0, 0 0 0 ] }")


STANDING = "rotation 1 0 0 -1.5707963267948966"  # the robot's z points up where the world's y does


@pytest.mark.parametrize(
    ("system", "robot", "north", "height_m", "quaternion"),
    [
        ("ENU", "translation 0 0 0.5", (0.0, 1.0, 0.0), 400.8, (0.0, 0.0, 0.0, 1.0)),
        ("NUE", f"translation 0 0.5 0 {STANDING}", (1.0, 0.0, 0.0), 2.8, (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)),
        ("EUN", f"translation 0 0.5 0 {STANDING}", (0.0, -1.0, 0.0), 2.8, (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)),
    ],
)
def test_the_system_of_axes_says_where_north_and_up_are(
    load_with, system, robot, north, height_m, quaternion
):
    """The letters of the system are the directions of x, y and z.

    An InertialUnit uses the axes of the file.
    """
    info = f'coordinateSystem "{system}" gpsReference 1 2 400'
    simulation = load_with("Compass { } InertialUnit { } Altimeter { translation 0 0 0.3 }", robot, info)
    simulation.step(STEP_MS)

    assert value_of(simulation, "compass") == pytest.approx(north, abs=1e-9)
    assert value_of(simulation, "altimeter") == pytest.approx(height_m)
    assert value_of(simulation, "inertial unit") == pytest.approx(quaternion, abs=1e-9)


def test_gravity_of_an_old_world_may_be_a_vector():
    """Until R2020a, the field `gravity` had three numbers."""
    text = '#VRML_SIM R2019a utf8\nWorldInfo { gravity 0 -3.7 0 } Robot { controller "ros" controllerArgs'
    simulation = load_scene(
        f'{text} [ "--name=a" "--synchronize" ] children [ Accelerometer {{ }} ] }}'.encode()
    )
    simulation.step(STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 3.7, 0.0))


@pytest.mark.parametrize(
    ("mount", "direction"),
    [("", (0.0, 0.0, 1.0)), ("rotation 1 0 0 1.5707963267948966", (0.0, 1.0, 0.0))],
)
def test_a_gyro_reads_the_turning_of_its_robot_about_its_own_axes(load_with, mount, direction):
    """The robot turns about the vertical, so a tilted gyro reads the rotation on another axis."""
    simulation = load_with(f"Gyro {{ translation 0.1 0 0 {mount} }}")

    drive(simulation, 0.2, 0.0, 0.5)

    assert value_of(simulation, "gyro") == pytest.approx([0.5 * part for part in direction])


def test_a_gyro_reads_the_motor_that_carries_it_too(load_with):
    """The robot and its turntable turn about the same axis, so their speeds add up."""
    simulation = load_with(ON_A_TURNTABLE.format("Gyro { }"))
    simulation.robots[0].motors["turntable"].set_position(math.inf)
    simulation.robots[0].motors["turntable"].set_velocity(2.0)

    drive(simulation, 0.0, 0.0, 0.5)

    assert value_of(simulation, "gyro") == pytest.approx((0.0, 0.0, 2.5))


def test_a_gyro_marks_what_it_does_not_measure(node_with):
    """In ROS, -1 in a covariance means "not measured".

    The covariance of the reading itself is unknown, and ROS writes 0 for an unknown covariance.
    """
    node = node_with("Gyro { }")
    node.call("gyro/enable", value=STEP_MS)
    inbox = node.inbox("gyro/values")

    node.call("robot/time_step", value=STEP_MS)

    (message,) = inbox
    assert message["angular_velocity"] == (0.0, 0.0, 0.0)
    assert message["orientation_covariance"][0] == message["linear_acceleration_covariance"][0] == -1.0
    assert "angular_velocity_covariance" not in message


@pytest.mark.parametrize(
    ("mount", "info", "expected"),
    [
        ("", "", (0.0, 0.0, 9.81)),
        ("", "gravity 1.62", (0.0, 0.0, 1.62)),
        ("rotation 0 1 0 1.5707963267948966", "", (-9.81, 0.0, 0.0)),
    ],
)
def test_an_accelerometer_at_rest_reads_the_reaction_to_gravity(load_with, mount, info, expected):
    """The reaction to gravity points up, in the axes of the sensor."""
    simulation = load_with(f"Accelerometer {{ {mount} }}", info=info)

    simulation.step(STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx(expected)


def test_an_accelerometer_reads_a_robot_that_speeds_up_and_then_drives_on(load_with):
    """The robot accelerates with at most 10 m/s2 along x; at constant speed only gravity is left."""
    simulation = load_with("Accelerometer { }", NORTH)

    drive(simulation, 2.0, 0.0, 0.0, steps=1)
    speeding_up = value_of(simulation, "accelerometer")
    drive(simulation, 2.0, 0.0, 0.0, steps=30)

    assert speeding_up == pytest.approx((10.0, 0.0, 9.81))
    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 0.0, 9.81))


def test_an_accelerometer_reads_the_last_basic_step_of_a_long_one(load_with):
    """The robot reaches its speed after two of six basic steps, so the last one has no acceleration."""
    simulation = load_with("Accelerometer { }")
    drive(simulation, 0.5, 0.0, 0.0, steps=0)

    simulation.step(6 * STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 0.0, 9.81))


def test_an_accelerometer_off_the_middle_reads_the_pull_to_the_middle(load_with):
    """The value is 2 rad/s squared, times 0.3 m, toward the center.

    The reading lags by half a basic step.
    """
    simulation = load_with("Accelerometer { translation 0.3 0 0 }")

    drive(simulation, 0.0, 0.0, 2.0)

    late_rad = 2.0 * STEP_MS / 1000.0 / 2.0
    pull = 2.0 * 2.0 * 0.3 * math.sin(late_rad) / late_rad
    assert value_of(simulation, "accelerometer") == pytest.approx(
        (-pull * math.cos(late_rad), pull * math.sin(late_rad), 9.81)
    )


def test_a_reset_is_no_acceleration(load_with):
    """A reset changes the velocity without a force, so the accelerometer must not report the change."""
    simulation = load_with("Accelerometer { }")
    drive(simulation, 0.5, 0.0, 0.0)

    simulation.reset()
    simulation.step(STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 0.0, 9.81))


def test_an_inertial_unit_reads_its_rotation_in_the_world(load_with):
    """The robot and the mount are each turned by 90 degrees about the vertical."""
    simulation = load_with(f"InertialUnit {{ {NORTH} }}", NORTH)

    simulation.step(STEP_MS)

    assert value_of(simulation, "inertial unit") == pytest.approx((0.0, 0.0, 1.0, 0.0), abs=1e-9)


def test_an_inertial_unit_turns_with_its_robot(load_with):
    """A quaternion contains half of the rotation angle."""
    simulation = load_with("InertialUnit { }")

    drive(simulation, 0.0, 0.0, 0.5)

    half_rad = simulation.robots[0].body.heading_rad / 2.0
    assert value_of(simulation, "inertial unit") == pytest.approx(
        (0.0, 0.0, math.sin(half_rad), math.cos(half_rad))
    )


def test_the_noise_of_an_inertial_unit_turns_it_about_all_axes(load_with):
    """The noise is a fraction of pi. For small angles, the three rotations add up like a vector."""
    simulation = load_with("InertialUnit { noise 0.0001 }")

    simulation.step(STEP_MS)

    x, y, z, w = value_of(simulation, "inertial unit")
    halves = [0.0001 * math.pi * noise / 2.0 for noise in draws(3)]
    assert (x, y, z) == pytest.approx(halves, rel=1e-2)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)


def test_an_inertial_unit_rounds_each_number_to_its_resolution(load_with):
    """As in Webots, the rounded quaternion does not have length 1."""
    simulation = load_with("InertialUnit { resolution 0.5 }", "rotation 0 0 1 0.7")

    simulation.step(STEP_MS)

    assert value_of(simulation, "inertial unit") == pytest.approx((0.0, 0.0, 0.5, 1.0))


def test_an_inertial_unit_answers_its_noise(node_with):
    """A client that filters the readings needs the sensor's noise."""
    assert node_with("InertialUnit { noise 0.25 }").get("inertial_unit/get_noise") == 0.25


def test_an_inertial_unit_with_an_axis_switched_off_is_refused(load_with):
    """Webots then returns a rotation that no robot can have."""
    with pytest.raises(WorldError, match="an inertial unit with an axis that is switched off"):
        load_with("InertialUnit { yAxis FALSE }")


def test_an_altimeter_reads_its_height_and_that_of_the_reference(load_with):
    """The robot is at a height of 0.5 m, and the sensor is 0.3 m above the robot's origin."""
    simulation = load_with(
        "Altimeter { translation 0 0 0.3 }", "translation 0 0 0.5", info="gpsReference 1 2 400"
    )

    simulation.step(STEP_MS)

    assert value_of(simulation, "altimeter") == pytest.approx(400.8)


def test_an_altimeter_adds_noise_and_then_rounds(load_with):
    """The noise is in meters, and is added before rounding."""
    simulation = load_with("Altimeter { accuracy 3 resolution 0.25 }")
    (noise,) = draws(1)

    simulation.step(STEP_MS)

    assert value_of(simulation, "altimeter") == pytest.approx(0.25 * round(3.0 * noise / 0.25))


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ("", 0.0),
        ("lookupTable [ ]", 0.0),
        ("lookupTable [ 1 4095 0, 2 0 0 ]", 4095.0),
        ("lookupTable [ 1 4095 0, 2 0 0 ] resolution 100", 4100.0),
    ],
)
def test_a_light_sensor_in_a_world_without_lights_reads_darkness(load_with, fields, expected):
    """The sensor returns the table's value for an irradiance of 0. On an E-puck this is the largest value."""
    simulation = load_with(f"LightSensor {{ {fields} }}")

    simulation.step(STEP_MS)

    assert value_of(simulation, "light sensor") == expected


def test_the_table_of_a_light_sensor_adds_noise(load_with):
    """The noise is a fraction of the sensor's value."""
    simulation = load_with("LightSensor { lookupTable [ 1 4095 0.01, 2 0 0.01 ] }")
    (noise,) = draws(1)

    simulation.step(STEP_MS)

    assert value_of(simulation, "light sensor") == pytest.approx(4095.0 * (1.0 + 0.01 * noise))


def test_a_light_sensor_answers_its_table_or_the_default(node_with):
    """Without a table in the world file, the default is that of Webots."""
    assert node_with("LightSensor { }").get("light_sensor/get_lookup_table") == (0, 0, 0, 1, 1000, 0)
