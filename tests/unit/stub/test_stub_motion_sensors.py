"""GPS, compass, gyro and similar sensors, on a robot that stands, drives or turns."""

import math
import random

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.joints import Joint, JointFrame
from palaestra_sim.scene.motion import motion_of
from palaestra_sim.scene.motors import Motor, MotorSpec
from tests.robotino import WHEELS, wheel_speeds
from tests.scenes import load_scene

STEP_MS = 32
NORTH = "rotation 0 0 1 1.5707963267948966"  # the robot looks along +y
ON_A_TURNTABLE = """HingeJoint {{
  jointParameters HingeJointParameters {{ axis 0 0 1 }}
  device RotationalMotor {{ name "turntable" }}
  endPoint Solid {{ children [ {} ] physics Physics {{ }} }} }}"""


@pytest.fixture
def load(world, simple_robot):
    """`load(sensor, robot=..., info=...)` returns the simulation of a robot with that sensor and seed 7."""

    def begin(sensor, robot="", info="", objects=""):
        text = simple_robot.replace("DEF IR", f"{sensor} DEF IR")
        text = text.replace('name "robotino"', f'{robot} customData "7" name "robotino"', 1)
        return load_scene(world(objects, robot=text, info=info))

    return begin


@pytest.fixture
def device(start, world, simple_robot, ros):
    """`device(sensor)` returns the node of a robot with that sensor."""

    def begin(sensor):
        start(world(robot=simple_robot.replace("DEF IR", f"{sensor} DEF IR")))
        return ros.node("robotino")

    return begin


def drive(simulation, vx, vy, omega, steps=30):
    """Drive until the robot has reached that velocity."""
    motors = simulation.robots[0].motors
    for name, speed in zip(WHEELS, wheel_speeds(vx, vy, omega), strict=True):
        motors[name].set_position(math.inf)
        motors[name].set_velocity(speed)
    for _ in range(steps):
        simulation.step(STEP_MS)


def value_of(simulation, name):
    """Return the value of a sensor of the first robot."""
    return simulation.robots[0].sensors[name].value


def draws(count):
    """Return the first random numbers of the noise with seed 7."""
    noise = random.Random(7)
    return [noise.gauss(0.0, 1.0) for _ in range(count)]


def test_a_gps_reads_its_own_place_and_not_that_of_its_robot(load):
    """The GPS is 0.1 m ahead of the robot's center, and the robot looks north."""
    simulation = load(
        "GPS { translation 0.1 0 0.3 }", f"translation 1 2 0 {NORTH}", info="gpsReference 100 200 300"
    )

    simulation.step(STEP_MS)

    assert value_of(simulation, "gps") == pytest.approx((101.0, 202.1, 300.3))


def test_a_gps_reads_its_speed_in_the_axes_of_the_world(load):
    """The robot drives forward while it looks north."""
    simulation = load("GPS { }", NORTH)

    drive(simulation, 0.3, 0.0, 0.0)

    gps = simulation.robots[0].sensors["gps"]
    assert gps.speed.value == pytest.approx(0.3)
    assert gps.speed_vector.value == pytest.approx((0.0, 0.3, 0.0))


def test_a_gps_off_the_middle_moves_when_the_robot_turns(load):
    """The GPS is 0.2 m to the left of the center, so a left turn moves it backward."""
    simulation = load("GPS { translation 0 0.2 0 }")

    drive(simulation, 0.0, 0.0, 0.5, steps=1)
    heading_rad = simulation.robots[0].body.heading_rad
    speed = abs(simulation.robots[0].body.velocity[2]) * 0.2

    gps = simulation.robots[0].sensors["gps"]
    assert gps.speed.value == pytest.approx(speed)
    assert gps.speed_vector.value == pytest.approx(
        (-speed * math.cos(heading_rad), -speed * math.sin(heading_rad), 0.0)
    )


def test_a_gps_on_a_joint_moves_with_it(load):
    """The motor's speed adds to that of the robot: 2 rad/s at 0.1 m from the axis."""
    simulation = load(ON_A_TURNTABLE.format("GPS { translation 0.1 0 0 }"))
    simulation.robots[0].motors["turntable"].set_position(math.inf)
    simulation.robots[0].motors["turntable"].set_velocity(2.0)

    simulation.step(STEP_MS)

    angle_rad = 2.0 * STEP_MS / 1000.0
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    assert value_of(simulation, "gps") == pytest.approx((0.1 * c, 0.1 * s, 0.0))
    assert simulation.robots[0].sensors["gps"].speed_vector.value == pytest.approx((-0.2 * s, 0.2 * c, 0.0))


def test_a_place_on_a_slider_moves_along_its_axis():
    """The axis of the slider is in the frame of the joint, which is turned here."""
    frame = Frame(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, math.pi / 2.0))
    motor = Motor(MotorSpec(name="lift"))
    motor.speed_rad_s = 0.2
    end = JointFrame(
        frame, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), Joint(axis=(1.0, 0.0, 0.0), slides=True, motor=motor)
    )

    motion = motion_of(Frame(end, (1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.0)), body=None)

    assert motion.velocity == pytest.approx((0.0, 0.2, 0.0))
    assert motion.turning == (0.0, 0.0, 0.0)


def test_a_robot_that_is_placed_elsewhere_has_no_speed(load):
    """Webots also takes the speed from the physics, not from the difference of two positions."""
    simulation = load("GPS { }")
    simulation.step(STEP_MS)

    simulation.robots[0].place.translation = (3.0, 0.0, 0.0)
    simulation.step(STEP_MS)

    assert value_of(simulation, "gps")[0] == 3.0
    assert simulation.robots[0].sensors["gps"].speed.value == 0.0


def test_the_noise_of_a_gps_is_in_meters_and_that_of_its_speed_a_fraction(load):
    """As in Webots, the velocity vector has no noise."""
    simulation = load("GPS { accuracy 0.5 speedNoise 0.1 }", NORTH)
    expected = draws(8)

    drive(simulation, 0.3, 0.0, 0.0, steps=2)

    gps = simulation.robots[0].sensors["gps"]
    exact = simulation.robots[0].place.translation
    assert gps.value == pytest.approx(
        [at + 0.5 * noise for at, noise in zip(exact, expected[4:7], strict=True)]
    )
    assert gps.speed.value == pytest.approx(math.hypot(*gps.speed_vector.value) * (1.0 + 0.1 * expected[7]))


def test_a_gps_rounds_to_its_resolution(load):
    """Position and speed have separate resolutions."""
    simulation = load("GPS { resolution 0.25 speedResolution 0.2 }", "translation 1.1 -0.4 0")

    drive(simulation, 0.0, 0.5, 0.0, steps=1)

    gps = simulation.robots[0].sensors["gps"]
    assert gps.value == pytest.approx((1.0, -0.5, 0.0))
    assert gps.speed.value == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("sensor", "info", "fact"),
    [
        ("GPS { }", 'gpsCoordinateSystem "WGS84" gpsReference 90 0 0', "at most 84 degrees of latitude"),
        ("GPS { }", "gpsReference 1 2", "WorldInfo.gpsReference is not 3 numbers"),
    ],
)
def test_what_a_gps_cannot_read_is_refused(load, sensor, info, fact):
    """If the GPS returned a wrong position, a client would not notice."""
    with pytest.raises(WorldError, match=fact):
        load(sensor, info=info)


def test_a_gps_reads_a_worldinfo_that_follows_its_robot(simple_robot):
    """The order of the nodes in a world file does not matter."""
    robot = simple_robot.replace("DEF IR", "GPS { } DEF IR")

    simulation = load_scene(f"#VRML_SIM R2023b utf8\n{robot}\nWorldInfo {{ gpsReference 1 2 3 }}\n".encode())
    simulation.step(STEP_MS)

    assert value_of(simulation, "gps") == pytest.approx((1.0, 2.0, 3.0))


def test_a_gps_answers_its_coordinate_system_and_converts_angles(device):
    """As in the library of Webots, each part of the angle is truncated toward zero."""
    node = device("GPS { }")

    def converted(angle):
        return node.get("gps/decimal_degrees_to_degrees_minutes_seconds", decimalDegrees=angle)

    assert node.get("gps/get_coordinate_system") == 0
    assert converted(46.519) == "46° 31′ 8″"  # noqa: RUF001 - as Webots
    assert converted(-6.5) == "-6° -30′ 0″"  # noqa: RUF001 - as Webots


def test_a_gps_is_in_the_frame_of_its_name_except_for_its_speed(device):
    """The real controller leaves the frame of the speed message empty."""
    node = device("GPS { }")

    node.call("gps/enable", value=STEP_MS)

    frames = [
        node.publishers(f"gps/{name}")[0].template["header"].get("frame_id")
        for name in ("values", "speed", "speed_vector")
    ]
    assert frames == ["robotino/gps", None, "robotino/gps"]


@pytest.mark.parametrize(
    ("robot", "mount", "north"),
    [
        ("", "", (0.0, 1.0, 0.0)),
        (NORTH, "", (1.0, 0.0, 0.0)),
        (NORTH, NORTH, (0.0, -1.0, 0.0)),
        ("", "rotation 1 0 0 1.5707963267948966", (0.0, 0.0, -1.0)),
    ],
)
def test_a_compass_shows_north_in_its_own_frame(load, robot, mount, north):
    """North is +y of the world, and the rotation of the robot and of the mount turn the sensor."""
    simulation = load(f"Compass {{ {mount} }}", robot)

    simulation.step(STEP_MS)

    assert value_of(simulation, "compass") == pytest.approx(north)


def test_a_compass_turns_against_its_robot(load):
    """The manual of Webots computes the bearing as atan2 of the first two values."""
    simulation = load("Compass { }")

    drive(simulation, 0.0, 0.0, 0.5)

    heading_rad = simulation.robots[0].body.heading_rad
    assert heading_rad > 0.1
    assert value_of(simulation, "compass") == pytest.approx(
        (math.sin(heading_rad), math.cos(heading_rad), 0.0)
    )


def test_axes_go_through_table_and_resolution_and_one_that_is_off_is_nan(load):
    """The order is that of Webots: first the table, then the resolution."""
    simulation = load("Compass { lookupTable [ -1 -100 0, 1 100 0 ] resolution 30 zAxis FALSE }", NORTH)

    simulation.step(STEP_MS)

    x, y, z = value_of(simulation, "compass")
    assert (x, y) == pytest.approx((90.0, 0.0))
    assert math.isnan(z)


def test_each_axis_of_a_noisy_table_draws_its_own_noise(load):
    """The random numbers are drawn in the order x, y, z."""
    simulation = load("Compass { lookupTable [ -1 -100 0.5, 1 100 0.5 ] yAxis FALSE }", "rotation 0 0 1 0.5")
    first, third = draws(2)

    simulation.step(STEP_MS)

    x, y, z = value_of(simulation, "compass")
    assert x == pytest.approx(100.0 * math.sin(0.5) * (1.0 + 0.5 * first))
    assert math.isnan(y)
    assert z == pytest.approx(0.0 * third)


def test_a_sensor_without_a_table_answers_an_empty_one(device):
    """The field is empty by default."""
    assert device("Compass { }").get("compass/get_lookup_table") == ()


def test_a_sensor_answers_its_table(device):
    """The response has the rows one after the other, in one list."""
    node = device("Compass { lookupTable [ -1 -100 0, 1 100 0.5 ] }")

    assert node.get("compass/get_lookup_table") == (-1.0, -100.0, 0.0, 1.0, 100.0, 0.5)


def test_a_table_whose_inputs_do_not_grow_is_refused(load):
    """No value could be interpolated between such rows."""
    with pytest.raises(WorldError, match="the inputs of lookupTable do not increase; sort its rows"):
        load("Compass { lookupTable [ 1 1 0, 0 0 0 ] }")


STANDING = "rotation 1 0 0 -1.5707963267948966"  # the robot's z points up where the world's y does


@pytest.mark.parametrize(
    ("system", "robot", "north", "height_m", "quaternion"),
    [
        ("ENU", "translation 0 0 0.5", (0.0, 1.0, 0.0), 400.8, (0.0, 0.0, 0.0, 1.0)),
        ("NUE", f"translation 0 0.5 0 {STANDING}", (1.0, 0.0, 0.0), 2.8, (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)),
        ("EUN", f"translation 0 0.5 0 {STANDING}", (0.0, -1.0, 0.0), 2.8, (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)),
    ],
)
def test_the_system_of_axes_says_where_north_and_up_are(load, system, robot, north, height_m, quaternion):
    """The letters of the system are the directions of x, y and z.

    An InertialUnit uses the axes of the file.
    """
    info = f'coordinateSystem "{system}" gpsReference 1 2 400'
    simulation = load("Compass { } InertialUnit { } Altimeter { translation 0 0 0.3 }", robot, info)
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
def test_a_gyro_reads_the_turning_of_its_robot_about_its_own_axes(load, mount, direction):
    """The robot turns about the vertical, so a tilted gyro reads the rotation on another axis."""
    simulation = load(f"Gyro {{ translation 0.1 0 0 {mount} }}")

    drive(simulation, 0.2, 0.0, 0.5)

    assert value_of(simulation, "gyro") == pytest.approx([0.5 * part for part in direction])


def test_a_gyro_reads_the_motor_that_carries_it_too(load):
    """The robot and its turntable turn about the same axis, so their speeds add up."""
    simulation = load(ON_A_TURNTABLE.format("Gyro { }"))
    simulation.robots[0].motors["turntable"].set_position(math.inf)
    simulation.robots[0].motors["turntable"].set_velocity(2.0)

    drive(simulation, 0.0, 0.0, 0.5)

    assert value_of(simulation, "gyro") == pytest.approx((0.0, 0.0, 2.5))


def test_a_gyro_marks_what_it_does_not_measure(device):
    """In ROS, -1 in a covariance means "not measured".

    The covariance of the reading itself is unknown, which is 0.
    """
    node = device("Gyro { }")
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
def test_an_accelerometer_at_rest_reads_the_reaction_to_gravity(load, mount, info, expected):
    """The reaction to gravity points up, in the axes of the sensor."""
    simulation = load(f"Accelerometer {{ {mount} }}", info=info)

    simulation.step(STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx(expected)


def test_an_accelerometer_reads_a_robot_that_speeds_up_and_then_drives_on(load):
    """The robot accelerates with at most 10 m/s2 along x; at constant speed only gravity is left."""
    simulation = load("Accelerometer { }", NORTH)

    drive(simulation, 2.0, 0.0, 0.0, steps=1)
    speeding_up = value_of(simulation, "accelerometer")
    drive(simulation, 2.0, 0.0, 0.0, steps=30)

    assert speeding_up == pytest.approx((10.0, 0.0, 9.81))
    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 0.0, 9.81))


def test_an_accelerometer_reads_the_last_basic_step_of_a_long_one(load):
    """The robot reaches its speed after two of six basic steps, so the last one has no acceleration."""
    simulation = load("Accelerometer { }")
    drive(simulation, 0.5, 0.0, 0.0, steps=0)

    simulation.step(6 * STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 0.0, 9.81))


def test_an_accelerometer_off_the_middle_reads_the_pull_to_the_middle(load):
    """The value is the square of 2 rad/s times 0.3 m, toward the center; it is half a basic step late."""
    simulation = load("Accelerometer { translation 0.3 0 0 }")

    drive(simulation, 0.0, 0.0, 2.0)

    late_rad = 2.0 * STEP_MS / 1000.0 / 2.0
    pull = 2.0 * 2.0 * 0.3 * math.sin(late_rad) / late_rad
    assert value_of(simulation, "accelerometer") == pytest.approx(
        (-pull * math.cos(late_rad), pull * math.sin(late_rad), 9.81)
    )


def test_a_reset_is_no_acceleration(load):
    """The robot drove before the reset and stands after it, but this change is no acceleration."""
    simulation = load("Accelerometer { }")
    drive(simulation, 0.5, 0.0, 0.0)

    simulation.reset()
    simulation.step(STEP_MS)

    assert value_of(simulation, "accelerometer") == pytest.approx((0.0, 0.0, 9.81))


def test_an_inertial_unit_reads_its_rotation_in_the_world(load):
    """The robot and the mount are each turned by 90 degrees about the vertical."""
    simulation = load(f"InertialUnit {{ {NORTH} }}", NORTH)

    simulation.step(STEP_MS)

    assert value_of(simulation, "inertial unit") == pytest.approx((0.0, 0.0, 1.0, 0.0), abs=1e-9)


def test_an_inertial_unit_turns_with_its_robot(load):
    """A quaternion contains half of the rotation angle."""
    simulation = load("InertialUnit { }")

    drive(simulation, 0.0, 0.0, 0.5)

    half_rad = simulation.robots[0].body.heading_rad / 2.0
    assert value_of(simulation, "inertial unit") == pytest.approx(
        (0.0, 0.0, math.sin(half_rad), math.cos(half_rad))
    )


def test_the_noise_of_an_inertial_unit_turns_it_about_all_axes(load):
    """The noise is a fraction of pi. For small angles, the three rotations add up like a vector."""
    simulation = load("InertialUnit { noise 0.0001 }")

    simulation.step(STEP_MS)

    x, y, z, w = value_of(simulation, "inertial unit")
    halves = [0.0001 * math.pi * noise / 2.0 for noise in draws(3)]
    assert (x, y, z) == pytest.approx(halves, rel=1e-2)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)


def test_an_inertial_unit_rounds_each_number_to_its_resolution(load):
    """As in Webots, the rounded quaternion does not have length 1."""
    simulation = load("InertialUnit { resolution 0.5 }", "rotation 0 0 1 0.7")

    simulation.step(STEP_MS)

    assert value_of(simulation, "inertial unit") == pytest.approx((0.0, 0.0, 0.5, 1.0))


def test_an_inertial_unit_answers_its_noise(device):
    """The service returns the value of the field."""
    assert device("InertialUnit { noise 0.25 }").get("inertial_unit/get_noise") == 0.25


def test_an_inertial_unit_with_an_axis_switched_off_is_refused(load):
    """Webots then returns a rotation that no robot can have."""
    with pytest.raises(WorldError, match="an inertial unit with an axis that is switched off"):
        load("InertialUnit { yAxis FALSE }")


def test_an_altimeter_reads_its_height_and_that_of_the_reference(load):
    """The robot is at a height of 0.5 m, and the sensor is 0.3 m above the robot's origin."""
    simulation = load("Altimeter { translation 0 0 0.3 }", "translation 0 0 0.5", info="gpsReference 1 2 400")

    simulation.step(STEP_MS)

    assert value_of(simulation, "altimeter") == pytest.approx(400.8)


def test_an_altimeter_adds_noise_and_then_rounds(load):
    """The noise is in meters, and is added before rounding."""
    simulation = load("Altimeter { accuracy 3 resolution 0.25 }")
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
def test_a_light_sensor_in_a_world_without_lights_reads_darkness(load, fields, expected):
    """The sensor returns the table's value for an irradiance of 0. On an E-puck this is the largest value."""
    simulation = load(f"LightSensor {{ {fields} }}")

    simulation.step(STEP_MS)

    assert value_of(simulation, "light sensor") == expected


def test_the_table_of_a_light_sensor_adds_noise(load):
    """The noise is a fraction of the sensor's value."""
    simulation = load("LightSensor { lookupTable [ 1 4095 0.01, 2 0 0.01 ] }")
    (noise,) = draws(1)

    simulation.step(STEP_MS)

    assert value_of(simulation, "light sensor") == pytest.approx(4095.0 * (1.0 + 0.01 * noise))


def test_a_light_sensor_answers_its_table_or_the_default(device):
    """Without a table in the world file, the default is that of Webots."""
    assert device("LightSensor { }").get("light_sensor/get_lookup_table") == (0, 0, 0, 1, 1000, 0)
