"""Radar: the Solids that it detects and their values, in every physics."""

import math

import pytest

from palaestra_sim.scene.devices.radar import Echo, merged

ANY = "minRadialSpeed 0 maxRadialSpeed 0"
BALL = "boundingObject Sphere { radius 0.1 } radarCrossSection 2"
WALL = "Solid { translation 1.5 0 0.5 boundingObject Box { size 0.1 1 1 } }"


@pytest.fixture
def radar(load):
    """`radar(objects, fields)` returns the simulation and the radar at the origin, which looks along x."""

    def begin(objects, fields=ANY):
        source = f"""#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep 32 }}
{objects}
Robot {{ supervisor TRUE controller "ros" controllerArgs [ "--name=r" "--synchronize" ]
  children [ Radar {{ translation 0 0 0.5 {fields} }} ] boundingObject Box {{ size 0.2 0.2 1 }} }}"""
        simulation = load(source.encode())
        (device,) = simulation.robots[0].parts.devices.sensors.values()
        device.enabled(32)
        return simulation, device

    return begin


def seen(radar, *arguments):
    """Return the targets of the radar after one step."""
    simulation, device = radar(*arguments)
    simulation.step(32)
    return device.seen


def solid(x, y=0.0, z=0.5, fields=BALL):
    """Return a ball of 10 cm that radars detect."""
    return f'Solid {{ translation {x} {y} {z} name "{x} {y}" {fields} }}'


def test_a_target_has_the_distance_azimuth_and_power_of_webots(radar):
    """As in Webots, the azimuth is positive to the right. The power follows the radar equation, in dBm."""
    (echo,) = seen(radar, solid(4, -1))
    wavelength, distance = 299_792_458.0 / 24e9, math.hypot(4, 1)
    power_w = 0.001 * 10**0.1 * 100**2 * wavelength**2 * 2 / ((4 * math.pi) ** 3 * distance**4)

    assert (echo.distance, echo.azimuth) == pytest.approx((distance, math.atan2(1, 4)))
    assert echo.message()["receivedPower"] == pytest.approx(10 * math.log10(power_w / 0.001))


@pytest.mark.parametrize(
    ("objects", "fields", "count"),
    [
        (solid(2) + solid(3), ANY, 2),
        (solid(0.5), ANY, 0),
        (solid(60), ANY, 0),
        (solid(2, 3), ANY, 0),
        (solid(-2), ANY, 0),
        (solid(2, z=1.5), ANY, 0),
        (solid(2, fields="boundingObject Sphere { radius 0.1 }"), ANY, 0),
        (solid(2, fields="radarCrossSection 1"), ANY, 1),
        (solid(40), f"{ANY} minDetectableSignal -60", 0),
        (solid(2), f"{ANY} minAbsoluteRadialSpeed 0.1", 0),
        (solid(2), "", 0),
    ],
    ids=[
        "two",
        "too near",
        "too far",
        "beside",
        "behind",
        "above",
        "no cross section",
        "a point",
        "too weak",
        "at rest",
        "the limits of speed that a Radar has by default",
    ],
)
def test_a_target_is_seen_within_the_limits_of_the_radar(radar, objects, fields, count):
    """The fields of the Radar node limit distance, angle and speed."""
    assert len(seen(radar, objects, fields)) == count


def test_a_target_at_the_edge_is_where_its_visible_part_is(radar):
    """The radar detects a target of which only a part is in view.

    The azimuth that it reports is inside the field of view.
    """
    (echo,) = seen(
        radar, solid(2, 0.88, fields="boundingObject Box { size 0.1 0.2 0.2 } radarCrossSection 1")
    )

    assert echo.azimuth == -0.39
    assert echo.distance < math.hypot(2, 0.88)


@pytest.mark.parametrize(
    "obstacle",
    [
        WALL,
        "Solid { translation 1.5 0 0.5 boundingObject Cylinder { radius 0.2 height 1 } }",
        "Solid { translation 1.5 0 0.5 boundingObject Sphere { radius 0.2 } }",
    ],
    ids=["box", "cylinder", "ball"],
)
def test_a_target_is_hidden_only_if_the_radar_knows_occlusion(radar, obstacle):
    """With `occlusion`, an object hides the target behind it, but not a target next to it."""
    assert len(seen(radar, obstacle + solid(3))) == 1
    assert seen(radar, obstacle + solid(3), f"{ANY} occlusion TRUE") == []
    assert len(seen(radar, obstacle + solid(3, 1.1), f"{ANY} occlusion TRUE")) == 1


def test_a_speed_is_the_change_of_distance_between_two_samples(radar):
    """A Solid that only a supervisor moves therefore has a speed too.

    The speed is positive if the target moves away.
    """
    simulation, device = radar(f"DEF IT {solid(2)}")
    simulation.step(32)
    assert device.seen[0].speed == 0.0
    node = simulation.tree.of_def("IT")
    node.place.translation = (2.048, 0.0, 0.5)
    simulation.step(32)

    assert device.seen[0].speed == pytest.approx(1.5)


def test_a_reset_begins_anew(radar):
    """The jump of a target back to its start is not a motion, so the speed after the reset is 0."""
    simulation, device = radar(f"DEF IT {solid(2)}")
    simulation.step(64)
    simulation.tree.of_def("IT").place.translation = (3.0, 0.0, 0.5)
    simulation.step(64)
    simulation.reset()
    simulation.step(64)

    assert (device.seen[0].distance, device.seen[0].speed) == (2.0, 0.0)


def test_a_target_that_is_imported_or_removed_comes_and_goes(radar):
    """A supervisor may add and remove targets while it randomizes a scene."""
    simulation, device = radar("")
    children = simulation.tree.field_of(simulation.tree.root, "children", simulation)
    simulation.add(f"DEF IT {solid(2)}", children, -1)
    simulation.step(32)
    assert len(device.seen) == 1

    simulation.remove(simulation.tree.of_def("IT"))
    simulation.step(32)

    assert device.seen == []


def test_targets_in_one_cell_are_one_with_the_mean_by_power():
    """Targets merge if their distances are within one cell.

    If the radar distinguishes speeds, their speeds must be near each other too.
    """
    near, far, fast = Echo(2.0, 3.0, 0.0, 0.1), Echo(2.4, 1.0, 0.4, 0.5), Echo(2.2, 1.0, 9.0, 0.0)

    assert merged([near, far], (0.5, 0.0)) == [Echo(2.1, 4.0, pytest.approx(0.1), pytest.approx(0.2))]
    assert merged([near, fast], (0.5, 1.0)) == [near, fast]
    assert merged([near, far], (0.0, 0.0)) == [near, far]


def test_noise_is_drawn_for_each_reading(radar):
    """The standard deviations are the noise fields of the Radar node."""
    (echo,) = seen(radar, solid(3), f"{ANY} rangeNoise 0.1 speedNoise 0.1 angularNoise 0.1")

    assert 0.0 < abs(echo.distance - 3.0) < 1.0
    assert 0.0 < abs(echo.speed) < 1.0
    assert 0.0 < abs(echo.azimuth) < 1.0


def test_noise_to_a_distance_of_nothing_is_no_error(radar):
    """With noise the distance can become 0, and an infinite received power would end the simulator."""
    simulation, device = radar(solid(0.2), f"{ANY} minRange 0 rangeNoise 0.2")
    readings = []
    for _ in range(50):
        simulation.step(32)
        readings += device.value

    assert min(reading["distance"] for reading in readings) == 0.0
    assert all(math.isfinite(reading["receivedPower"]) for reading in readings)
