"""Devices that measure other objects: readings of connectors and radars with objects at known positions."""

import numpy as np
import pytest

from tests.values.frames import frame
from tests.values.standing import MOUNT, POSES
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, enable, move, robot

HALF_TURN = np.pi
# The frame of a connector in the frame of the other connector, and whether both fit. They fit if they face
# each other along their x axes, at most 5 cm apart, tilted by at most 0.2 rad, and turned by a multiple of a
# quarter turn within 0.3 rad.
CONNECTORS = [
    (frame((0.0, 0.0, 0.0), (0, 0, 1), HALF_TURN - 1e-6), 1),
    (frame((0.03, 0.03, -0.02), (0, 0, 1), HALF_TURN - 0.19), 1),
    (frame((0.03, 0.03, -0.03), (0, 0, 1), HALF_TURN - 1e-6), 0),
    (frame((0.0, 0.0, 0.0), (0, 0, 1), HALF_TURN - 0.21), 0),
    (frame((0.0, 0.0, 0.0), (0, 0, 1), 1e-6), 0),
    (frame((0.0, 0.0, 0.0), (0, 0, 1), HALF_TURN - 1e-6) @ frame(axis=(1, 0, 0), angle_rad=1.5), 1),
    (frame((0.0, 0.0, 0.0), (0, 0, 1), HALF_TURN - 1e-6) @ frame(axis=(1, 0, 0), angle_rad=0.75), 0),
]
CONNECTOR = 'Connector {{ name "{}" {} distanceTolerance 0.05 axisTolerance 0.2 rotationTolerance 0.3 }}'
RADAR = """Radar {{ name "radar" {} minRange 1 maxRange 20 horizontalFieldOfView 1.5 verticalFieldOfView 1.2
  minRadialSpeed 0 maxRadialSpeed 0 antennaGain 15 frequency 20 transmittedPower 2 }}"""
TARGETS = [(3.0, 0.5, 0.4), (7.0, -4.0, -1.0), (19.0, 0.0, 6.0)]  # in the frame of the radar, in meters
# Points outside the radar's field of view or range.
HIDDEN = [(3.0, 4.0, 0.0), (-3.0, 0.0, 0.0), (3.0, 0.0, 2.5), (25.0, 0.0, 0.0)]


@cached
def simulation_of(setting):
    """Return a simulation of two robots with a connector each, a radar, and a target of no size."""
    first = robot(CONNECTOR.format("mine", MOUNT.fields) + RADAR.format(MOUNT.fields))
    second = robot(CONNECTOR.format("theirs", ""), name="other")
    target = 'DEF TARGET Solid { name "target" radarCrossSection 2.5 }'
    simulation = setting.load(first + second + target)
    enable(simulation)
    return simulation


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_connector_feels_another_one_where_both_fit(setting):
    """Only the pose of one connector in the frame of the other counts, so the robots may lean."""
    simulation = simulation_of(setting)
    for pose in POSES:
        move(simulation, "R", setting.put(pose))
        for other, presence in CONNECTORS:
            move(simulation, "OTHER", setting.put(pose @ MOUNT @ other))
            simulation.step(STEP_MS)
            values = device(simulation, "mine").value, device(simulation, "theirs", 1).value
            assert values == (presence, presence), (pose, other)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_radar_measures_distance_azimuth_and_power_of_a_point(setting):
    """The power follows the radar equation, in dBm.

    For a radar with z up, the azimuth is positive to the right.
    """
    wavelength, gain = 299_792_458.0 / 20e9, 10.0**1.5
    simulation = simulation_of(setting)
    for pose in POSES:
        move(simulation, "R", setting.put(pose))
        for place in TARGETS:
            move(simulation, "TARGET", setting.put(frame(pose @ MOUNT @ place)))
            simulation.step(STEP_MS)
            (echo,) = device(simulation, "radar").value
            distance = np.linalg.norm(place)
            power = 1e-3 * 10**0.2 * gain**2 * wavelength**2 * 2.5 / ((4.0 * np.pi) ** 3 * distance**4)
            read = [echo["distance"], echo["azimuth"], echo["receivedPower"]]
            azimuth = np.arctan2(-place[1], place[0])
            assert read == pytest.approx([distance, azimuth, 10.0 * np.log10(power / 1e-3)]), (pose, place)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_radar_sees_nothing_beyond_its_field_of_view(setting):
    """The targets are to the side of the radar, behind it, above it, or beyond its range."""
    simulation = simulation_of(setting)
    for pose in POSES:
        move(simulation, "R", setting.put(pose))
        for place in HIDDEN:
            move(simulation, "TARGET", setting.put(frame(pose @ MOUNT @ place)))
            simulation.step(STEP_MS)
            assert device(simulation, "radar").value == [], (pose, place)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_radar_measures_how_fast_a_target_moves_away(setting):
    """The speed is the change of the target's position, along the line from the radar to the target."""
    simulation = simulation_of(setting)
    before, after = np.array([4.0, 1.0, 0.2]), np.array([4.1, 0.9, 0.25])
    for pose in POSES:
        move(simulation, "R", setting.put(pose))
        for place in (before, after):
            move(simulation, "TARGET", setting.put(frame(pose @ MOUNT @ place)))
            simulation.step(STEP_MS)
        (echo,) = device(simulation, "radar").value
        speed = (after - before) @ after / np.linalg.norm(after) / (STEP_MS / 1000.0)
        assert echo["speed"] == pytest.approx(speed), pose
