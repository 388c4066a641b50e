"""Fields whose effect no single reading shows; the expected behavior is that of Webots' manual."""

import numpy as np
import pytest

from tests.values.frames import frame
from tests.values.worlds import PHYSICS, STEP_MS, Setting, device, enable, robot

HALF_TURN = np.pi - 1e-6
TARGET = 'Solid { translation %s 0 0 name "%s" radarCrossSection 1 }'
RADAR = "Radar { minRadialSpeed 0 maxRadialSpeed 0 %s }"


def of(physics, parts, others=""):
    """Return the simulation of a robot with these parts, after one step with all devices enabled."""
    simulation = Setting(physics).load(robot(parts) + others)
    for index in range(len(simulation.robots)):
        enable(simulation, index)
    simulation.step(STEP_MS)
    return simulation


def service(simulation, name, path):
    """Return the handler of a service of a device."""
    kind, it = simulation.robots[0].parts.devices.rows[name]
    return next(handler for row, _, handler in kind.services(it) if row == path)


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize(("locked", "written"), [(True, "TRUE"), (False, "FALSE")])
def test_a_connector_begins_locked_as_its_field_says(physics, locked, written):
    """A client reads with `is_locked` whether the connector is closed at the start."""
    simulation = of(physics, f"Connector {{ isLocked {written} }}")

    assert device(simulation, "connector").locked is locked


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("written", ["TRUE", "FALSE"])
def test_a_gripper_begins_switched_on_as_its_field_says(physics, written):
    """A client reads with `is_on` whether the gripper is on at the start."""
    simulation = of(physics, f"VacuumGripper {{ isOn {written} }}")

    assert service(simulation, "vacuum gripper", "is_on")(None) == {"value": written == "TRUE"}


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize(
    ("rotations", "twist_rad", "presence"),
    [(3, 2.0 * np.pi / 3.0, 1), (3, np.pi / 2.0, 0), (2, np.pi, 1), (2, np.pi / 2.0, 0), (0, 1.0, 1)],
)
def test_connectors_fit_at_each_of_their_rotations(physics, rotations, twist_rad, presence):
    """With n rotations, connectors fit at multiples of 360 degrees / n; with 0, at every angle."""
    fields = f"rotationTolerance 0.3 numberOfRotations {rotations}"
    facing = frame((0, 0, 0), (0, 0, 1), HALF_TURN) @ frame(axis=(1, 0, 0), angle_rad=twist_rad)
    other = robot(f"Connector {{ {fields} }}", facing.fields, name="other")
    simulation = of(physics, f"Connector {{ {fields} }}", other)

    assert device(simulation, "connector").value == presence


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize(
    ("fields", "count"),
    [("", 2), ("cellDistance 1.5", 1), ("cellDistance 0.5", 2), ("cellDistance 1.5 cellSpeed 1", 1)],
)
def test_a_radar_merges_targets_within_one_cell(physics, fields, count):
    """Two targets at rest, 1 m apart, are one target if a cell is longer."""
    simulation = of(physics, RADAR % fields, TARGET % (3, "a") + TARGET % (4, "b"))

    assert len(device(simulation, "radar").value) == count


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize(("asked_hz", "set_hz"), [(3.0, 3.0), (7.0, 7.0), (2.9, 5.0), (7.1, 5.0)])
def test_a_lidar_turns_at_frequencies_within_its_limits(physics, asked_hz, set_hz):
    """Webots ignores a frequency outside of `minFrequency` and `maxFrequency`."""
    simulation = of(physics, 'Lidar { type "rotating" defaultFrequency 5 minFrequency 3 maxFrequency 7 }')
    request = type("Request", (), {"value": asked_hz})
    service(simulation, "lidar", "set_frequency")(request)
    frequencies = service(simulation, "lidar", "get_frequency_info")(None)

    assert frequencies == {"frequency": set_hz, "minFrequency": 3.0, "maxFrequency": 7.0}
