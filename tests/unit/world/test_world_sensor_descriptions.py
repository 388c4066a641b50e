"""The descriptions of Webots' lidars, sonars and infrared sensors agree with Webots' documentation.

The numbers here come from Webots' user guide and PROTO files, and from data sheets.
"""

import math
import re

import pytest

from tests.unit.world.robot_descriptions import INFRARED, LIDARS, PROTOS, described, numbers, of_type

# The number of layers, the elevations of the highest and the lowest layer in degrees, and the noise in
# meters.
LAYERS = {
    "VelodynePuck": (16, 15, -15, 0.03),
    "VelodyneVLP-16": (16, 15, -15, 0.03),
    "VelodyneHDL-32E": (32, 0.7, -40.7, 0.02),
    "VelodyneHDL-64E": (64, 2, -24.8, 0.02),
}


def headings(name: str, prefix: str) -> list[float]:
    """Return the azimuths in degrees of the distance sensors with a name prefix, ordered by their number."""
    found = {}
    for sensor in of_type(described(name).body.walk(), "DistanceSensor"):
        number = (sensor.text("name") or "").removeprefix(prefix)
        found[int(number)] = math.degrees(heading(numbers(sensor, "rotation")))
    return [found[number] for number in sorted(found)]


def heading(rotation: tuple[float, ...]) -> float:
    """Return the azimuth of the x axis after a rotation, in radians."""
    x, y, z, angle = rotation
    cosine, sine = math.cos(angle), math.sin(angle)
    return math.atan2(x * y * (1 - cosine) + z * sine, x * x * (1 - cosine) + cosine)


def test_the_lidar_of_the_turtlebot_is_described_beside_it() -> None:
    """The lidar is the default of `extensionSlot`, so a world that does not set the slot has a lidar."""
    text = (PROTOS / "TurtleBot3Burger.proto").read_text()
    (address,) = re.findall(r'^EXTERNPROTO "(.*)"$', text, re.MULTILINE)
    (lidar,) = described("RobotisLds01").body.nodes

    assert (PROTOS / address).is_file()
    assert (lidar.type_name, lidar.text("name")) == ("Lidar", "LDS-01")
    assert numbers(lidar, "horizontalResolution") == (360,)
    assert numbers(lidar, "minRange") + numbers(lidar, "maxRange") == (0.12, 3.5)


@pytest.mark.parametrize("name", LIDARS)
def test_a_lidar_has_the_documented_rays(name: str) -> None:
    """A policy that was trained with such a lidar must fit the real device.

    The values are the field of view in degrees, the number of rays, and the range.
    """
    (lidar,) = described(name).body.nodes
    degrees, rays, nearest, farthest = LIDARS[name]

    assert numbers(lidar, "fieldOfView") == pytest.approx((math.radians(degrees),), abs=1e-4)
    assert numbers(lidar, "horizontalResolution") == (rays,)
    assert lidar.numbers("minRange") == (None if nearest is None else (nearest,))
    assert numbers(lidar, "maxRange") == (farthest,)


@pytest.mark.parametrize("name", LAYERS)
def test_a_lidar_of_many_layers_looks_up_and_down_as_documented(name: str) -> None:
    """The tilt moves all layers, and the noise is a fraction of the range."""
    (lidar,) = described(name).body.nodes
    layers, highest, lowest, noise_m = LAYERS[name]
    (tilt,), (high,) = lidar.numbers("tiltAngle") or (0.0,), numbers(lidar, "verticalFieldOfView")

    assert numbers(lidar, "numberOfLayers") == (layers,)
    assert [math.degrees(tilt + it * high) for it in (0.5, -0.5)] == pytest.approx(
        [highest, lowest], abs=0.05
    )
    assert numbers(lidar, "noise")[0] * LIDARS[name][3] == pytest.approx(noise_m, rel=2e-3)


@pytest.mark.parametrize("name", INFRARED)
def test_an_infra_red_sensor_returns_the_volts_of_its_data_sheet(name: str) -> None:
    """The voltage falls with the distance, even beyond the documented range."""
    (sensor,) = described(name).body.nodes
    table = numbers(sensor, "lookupTable")
    distances, volts = table[::3], table[1::3]

    assert sensor.text("type") is None
    assert set(INFRARED[name]) <= set(zip(distances, volts, strict=True))
    assert sorted(distances) == list(distances)
    assert sorted(volts, reverse=True) == list(volts)


def test_the_ground_sensors_of_the_e_puck_look_down_from_left_to_right() -> None:
    """The ground sensors are part of the robot only if `groundSensorsSlot` contains them."""
    sensors = of_type(described("E-puckGroundSensors").body.walk(), "DistanceSensor")

    assert [it.text("name") for it in sensors] == ["gs0", "gs1", "gs2"]
    assert [numbers(it, "translation")[1] for it in sensors] == [0.01, 0, -0.01]
    assert {numbers(it, "rotation") for it in sensors} == {(0, 1, 0, 1.5708)}


def test_infrared_sensors_of_the_e_puck_look_where_the_user_guide_says() -> None:
    """The user guide counts angles from the negative y axis, in radians."""
    guide = [1.27, 0.77, 0.0, 5.21, 4.21, math.pi, 2.37, 1.87]
    expected = [math.remainder(it - math.pi / 2, math.tau) for it in guide]

    assert headings("E-puck", "ps") == pytest.approx([math.degrees(it) for it in expected], abs=0.5)


@pytest.mark.parametrize("name", ["Pioneer3at", "Pioneer3dx"])
def test_sonars_of_the_pioneers_are_20_degrees_apart_and_40_at_the_sides(name: str) -> None:
    """As in the figure of the user guide, the sonars go clockwise from the left."""
    front = [90, 50, 30, 10, -10, -30, -50, -90]
    expected = front + [-180 - it if it <= 0 else 180 - it for it in reversed(front)]

    assert headings(name, "so") == pytest.approx(expected, abs=0.1)
