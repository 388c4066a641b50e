"""Sensors of position, direction and surroundings, compared with formulas in each simulator."""

import numpy as np
import pytest

from tests.values.standing import BEACON, GRAVITY, MOUNT, POSES, REFERENCE, ROWS, SAID
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, enable, move, robot


@cached
def simulation_of(setting):
    """Return a simulation of one robot with all sensors, and of another robot with a beacon."""
    sensors = " ".join(row.node.format(place=f'name "{row.name}" {MOUNT.fields}') for row in ROWS)
    beacon = robot('Emitter { name "beacon" channel 3 }', setting.put(BEACON).fields, name="other")
    reference = "{} {} {}".format(*REFERENCE)
    world = setting.load(robot(sensors) + beacon, f"gravity {GRAVITY} gpsReference {reference}")
    enable(world)
    return world


@cached
def readings_at(setting, index):
    """Return the readings of all sensors, by name, with the robot at one of the poses."""
    simulation = simulation_of(setting)
    move(simulation, "R", setting.put(POSES[index]))
    device(simulation, "beacon", 1).send(SAID)
    simulation.step(STEP_MS)
    return {row.name: np.array(row.read(device(simulation, row.name))) for row in ROWS}


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_a_sensor_off_the_middle_of_a_tilted_robot_reads_what_the_formula_gives(row, setting):
    """A user who changes the simulator or the system of axes then trains on the same observations."""
    for index, pose in enumerate(POSES):
        expected = row.formula(setting.put(pose) @ MOUNT, setting)
        read = readings_at(setting, index)[row.name]
        assert read == pytest.approx(np.asarray(expected), abs=row.tolerance, nan_ok=True), pose
