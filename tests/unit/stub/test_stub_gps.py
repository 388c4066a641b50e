"""A GPS reads its own position and its speed in the axes of the world."""

import math

import pytest

from palaestra_sim.errors import WorldError
from tests.scenes import load_scene
from tests.unit.stub.sensors_in_motion import NORTH, ON_A_TURNTABLE, STEP_MS, draws, drive, value_of


def test_a_gps_reads_its_own_place_and_not_that_of_its_robot(load_with):
    """The GPS is 0.1 m ahead of the robot's center, and the robot looks north."""
    simulation = load_with(
        "GPS { translation 0.1 0 0.3 }", f"translation 1 2 0 {NORTH}", info="gpsReference 100 200 300"
    )

    simulation.step(STEP_MS)

    assert value_of(simulation, "gps") == pytest.approx((101.0, 202.1, 300.3))


def test_a_gps_reads_its_speed_in_the_axes_of_the_world(load_with):
    """The robot drives forward while it looks north."""
    simulation = load_with("GPS { }", NORTH)

    drive(simulation, 0.3, 0.0, 0.0)

    gps = simulation.robots[0].sensors["gps"]
    assert gps.speed.value == pytest.approx(0.3)
    assert gps.speed_vector.value == pytest.approx((0.0, 0.3, 0.0))


def test_a_gps_off_the_middle_moves_when_the_robot_turns(load_with):
    """The GPS is 0.2 m to the left of the center, so a left turn moves it backward."""
    simulation = load_with("GPS { translation 0 0.2 0 }")

    drive(simulation, 0.0, 0.0, 0.5, steps=1)
    heading_rad = simulation.robots[0].body.heading_rad
    speed = abs(simulation.robots[0].body.velocity[2]) * 0.2

    gps = simulation.robots[0].sensors["gps"]
    assert gps.speed.value == pytest.approx(speed)
    assert gps.speed_vector.value == pytest.approx(
        (-speed * math.cos(heading_rad), -speed * math.sin(heading_rad), 0.0)
    )


def test_a_gps_on_a_joint_moves_with_it(load_with):
    """The motor's speed adds to that of the robot: 2 rad/s at 0.1 m from the axis."""
    simulation = load_with(ON_A_TURNTABLE.format("GPS { translation 0.1 0 0 }"))
    simulation.robots[0].motors["turntable"].set_position(math.inf)
    simulation.robots[0].motors["turntable"].set_velocity(2.0)

    simulation.step(STEP_MS)

    angle_rad = 2.0 * STEP_MS / 1000.0
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    assert value_of(simulation, "gps") == pytest.approx((0.1 * c, 0.1 * s, 0.0))
    assert simulation.robots[0].sensors["gps"].speed_vector.value == pytest.approx((-0.2 * s, 0.2 * c, 0.0))


def test_a_robot_that_is_placed_elsewhere_has_no_speed(load_with):
    """Webots also takes the speed from the physics, not from the difference of two positions."""
    simulation = load_with("GPS { }")
    simulation.step(STEP_MS)

    simulation.robots[0].place.translation = (3.0, 0.0, 0.0)
    simulation.step(STEP_MS)

    assert value_of(simulation, "gps")[0] == 3.0
    assert simulation.robots[0].sensors["gps"].speed.value == 0.0


def test_the_noise_of_a_gps_is_in_meters_and_that_of_its_speed_a_fraction(load_with):
    """As in Webots, the velocity vector has no noise."""
    simulation = load_with("GPS { accuracy 0.5 speedNoise 0.1 }", NORTH)
    expected = draws(8)

    drive(simulation, 0.3, 0.0, 0.0, steps=2)

    gps = simulation.robots[0].sensors["gps"]
    exact = simulation.robots[0].place.translation
    assert gps.value == pytest.approx(
        [at + 0.5 * noise for at, noise in zip(exact, expected[4:7], strict=True)]
    )
    assert gps.speed.value == pytest.approx(math.hypot(*gps.speed_vector.value) * (1.0 + 0.1 * expected[7]))


def test_a_gps_rounds_to_its_resolution(load_with):
    """Position and speed have separate resolutions."""
    simulation = load_with("GPS { resolution 0.25 speedResolution 0.2 }", "translation 1.1 -0.4 0")

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
def test_what_a_gps_cannot_read_is_refused(load_with, sensor, info, fact):
    """If the GPS returned a wrong position, a client would not notice."""
    with pytest.raises(WorldError, match=fact):
        load_with(sensor, info=info)


def test_a_gps_reads_a_worldinfo_that_follows_its_robot(simple_robot):
    """The order of the nodes in a world file does not matter."""
    robot = simple_robot.replace("DEF IR", "GPS { } DEF IR")

    simulation = load_scene(f"#VRML_SIM R2023b utf8\n{robot}\nWorldInfo {{ gpsReference 1 2 3 }}\n".encode())
    simulation.step(STEP_MS)

    assert value_of(simulation, "gps") == pytest.approx((1.0, 2.0, 3.0))


def test_a_gps_answers_its_coordinate_system_and_converts_angles(node_with):
    """As in the library of Webots, each part of the angle is truncated toward zero."""
    node = node_with("GPS { }")

    def converted(angle):
        return node.get("gps/decimal_degrees_to_degrees_minutes_seconds", decimalDegrees=angle)

    assert node.get("gps/get_coordinate_system") == 0
    assert converted(46.519) == "46° 31′ 8″"  # noqa: RUF001 - as Webots
    assert converted(-6.5) == "-6° -30′ 0″"  # noqa: RUF001 - as Webots


def test_a_gps_is_in_the_frame_of_its_name_except_for_its_speed(node_with):
    """The real controller leaves the frame of the speed message empty."""
    node = node_with("GPS { }")

    node.call("gps/enable", value=STEP_MS)

    frames = [
        node.publishers(f"gps/{name}")[0].template["header"].get("frame_id")
        for name in ("values", "speed", "speed_vector")
    ]
    assert frames == ["robotino/gps", None, "robotino/gps"]
