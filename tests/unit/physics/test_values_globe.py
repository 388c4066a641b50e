"""With a reference on the globe, a GPS reads latitude, longitude and altitude."""

import numpy as np
import pytest

from tests.values.frames import Frame
from tests.values.globe import moved
from tests.values.standing import MOUNT, POSES
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, move, robot

# Latitude, longitude and altitude: on each side of the equator and of Greenwich, and at the edge of a UTM
# zone.
REFERENCES = (
    (46.5191, 6.5668, 400.0),
    (-33.8568, 151.2153, 5.0),
    (0.0, -78.4678, 2850.0),
    (-51.7, -54.0, 0.0),
)
FAR = 5000.0  # how many times farther the robot is than in the table of poses
DEGREES = 2e-8  # two millimeters


@cached
def simulation_of(setting, reference):
    """Return a simulation of a robot with a GPS, in a world with that reference."""
    info = f'gpsCoordinateSystem "WGS84" gpsReference {" ".join(map(str, reference))}'
    return setting.load(robot(f'GPS {{ name "gps" {MOUNT.fields} }}'), info)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("reference", REFERENCES, ids=str)
def test_a_gps_reads_degrees(setting, reference):
    """A drone flies to a position on a map, so north and east must follow the axes of the world."""
    simulation = simulation_of(setting, reference)
    latitude, longitude, altitude_m = reference
    for pose in POSES:
        far = Frame(pose.position * [FAR, FAR, 1.0], pose.rotation)
        move(simulation, "R", setting.put(far))
        simulation.step(STEP_MS)
        east_m, north_m, up_m = (far @ MOUNT).position
        north, east = moved(latitude, longitude, east_m, north_m)

        read = device(simulation, "gps").value
        assert read[:2] == pytest.approx((north, east), abs=DEGREES), far
        assert read[2] == pytest.approx(altitude_m + up_m, abs=1e-6)


@pytest.mark.parametrize("setting", SETTINGS[:1], ids=str)
def test_the_noise_of_a_gps_is_correlated_from_step_to_step(setting):
    """A filter must find a drift that lasts minutes, but independent noise would average out."""
    kept = 0.48  # correlation of the noise between one step and the next
    correlation = kept ** (1000.0 / STEP_MS)
    fields = f'name "gps" accuracy 2 noiseCorrelation {correlation:.20f}'
    simulation = setting.load(robot(f"GPS {{ {fields} }}"))
    values = []
    for _ in range(4000):
        simulation.step(STEP_MS)
        values.append(device(simulation, "gps").value)

    noise = np.array(values)
    for axis in noise.T:
        assert axis.std() == pytest.approx(2.0, rel=0.06)
        assert np.corrcoef(axis[:-1], axis[1:])[0, 1] == pytest.approx(kept, abs=0.04)
