"""A LightSensor measures the irradiance of all lights by the formulas in the manual of Webots."""

import math

import numpy as np
import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.tree.field_types import FieldType
from tests.values.frames import axis_angle, frame
from tests.values.standing import MOUNT, POSES
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, enable, move, robot

FILTER = np.array([0.9, 0.5, 0.1])
COLOR = np.array([1.0, 0.4, 0.2])
COLORED = "color 1 0.4 0.2"
PLACE = np.array([0.5, 2.0, 1.5])  # the position of the lights, in the axes of the file
TURNED = frame((1.0, -2.0, 0.5), (0.2, 0.9, -0.4), 1.3)  # a Pose that encloses some of the lights
DOWN = np.array([0.3, -0.2, -1.0])
CUT_RAD, BEAM_RAD = 1.2, 0.2
SENSOR = f"""LightSensor {{ name "NAME" {MOUNT.fields} colorFilter {" ".join(map(str, FILTER))}
  lookupTable [ 0 0 0, 100 100 0 ] }}"""


def facing(sensor, way):
    """Return the cosine between a sensor's x axis and a direction; 0 for light from behind."""
    return max(0.0, float(sensor.rotation[:, 0] @ way) / np.linalg.norm(way))


def directional(sensor, _setting):
    """Return the irradiance of a DirectionalLight; its ambient part comes from everywhere."""
    return COLOR * (0.25 + 3.0 * facing(sensor, -DOWN))


def point(sensor, _setting):
    """Return the irradiance of a PointLight, whose default attenuation ignores the distance."""
    return np.ones(3) * (0.5 + 2.0 * facing(sensor, PLACE - sensor.position))


def weakening(sensor, _setting):
    """Return the irradiance of a PointLight in a Pose; a light with an attenuation has no ambient part."""
    way = TURNED @ PLACE - sensor.position
    far = np.linalg.norm(way)
    return COLOR * 4.0 * facing(sensor, way) / (0.1 + 0.2 * far + 0.3 * far**2)


def spot(sensor, _setting):
    """Return the irradiance of a SpotLight, which decreases from the beam to the edge of the cone."""
    way = PLACE - sensor.position
    off = math.acos(-DOWN @ way / np.linalg.norm(DOWN) / np.linalg.norm(way))
    share = np.clip((CUT_RAD - off) / (CUT_RAD - BEAM_RAD), 0.0, 1.0)
    return np.ones(3) * 5.0 * share * facing(sensor, way)


def mountains(sensor, setting):
    """Return the irradiance of a TexturedBackgroundLight, from the south-east and above.

    Webots writes these numbers into every export of a world with this PROTO.
    """
    return np.ones(3) * (1.0 + 2.7 * 0.5 * facing(sensor, setting.axes @ [-0.55, 0.6, 1.0]))


def dark(_sensor, _setting):
    """Return the irradiance of a light that is switched off."""
    return np.zeros(3)


def words(vector):
    """Return numbers as text for a world file."""
    return " ".join(map(repr, map(float, vector)))


LIGHTS = {
    directional: f"""DirectionalLight {{
      ambientIntensity 0.25 intensity 3 {COLORED} direction {words(DOWN)} }}""",
    point: f"PointLight {{ ambientIntensity 0.5 intensity 2 location {words(PLACE)} }}",
    weakening: f"""Pose {{ {TURNED.fields} children [ PointLight {{ ambientIntensity 1 intensity 4 {COLORED}
      attenuation 0.1 0.2 0.3 location {words(PLACE)} }} ] }}""",
    spot: f"""SpotLight {{ intensity 5 location {words(PLACE)} direction {words(DOWN)}
      cutOffAngle {CUT_RAD} beamWidth {BEAM_RAD} }}""",
    mountains: "TexturedBackgroundLight { luminosity 0.5 }",
    dark: "DEF LAMP PointLight { on FALSE }",
}
WORLDS = {it.__name__: (it,) for it in LIGHTS} | {"all": tuple(LIGHTS)}


@cached
def simulation_of(setting, name):
    """Return a simulation of some lights, and of a robot with a sensor."""
    lights = "\n".join(LIGHTS[it] for it in WORLDS[name])
    simulation = setting.load(lights + robot(SENSOR.replace("NAME", "eye")))
    enable(simulation)
    return simulation


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("name", WORLDS)
def test_a_light_sensor_adds_what_each_light_contributes(setting, name):
    """A robot that learns to seek or avoid light must read the same irradiance in each simulator."""
    simulation = simulation_of(setting, name)
    for pose in POSES:
        move(simulation, "R", setting.put(pose))
        simulation.step(STEP_MS)
        sensor = setting.put(pose) @ MOUNT
        colors = sum(light(sensor, setting) for light in WORLDS[name])

        assert device(simulation, "eye").value == pytest.approx(FILTER @ colors / 3.0, rel=1e-6), pose


FLOOR = "Solid { rotation %s boundingObject Plane { size 1 1 } }"
BALL = "DEF BALL Solid { translation %s boundingObject Sphere { radius 0.1 } }"


def shaded(setting, way, hiding, occlusion="TRUE"):
    """Return the reading of a sensor, and the ambient and the direct irradiance of its two lights.

    The lights are a PointLight at `way` from the sensor, in its frame, and a DirectionalLight from there.
    `hiding` returns nodes of the world, and a part of the robot, for the positions of sensor and light.
    """
    pose = setting.put(POSES[3])
    sensor = pose @ MOUNT
    light = sensor.position + sensor.rotation @ way
    nodes, part = hiding(sensor.position, light)
    lights = f"""PointLight {{ ambientIntensity 0.5 intensity 2 location {words(light)} }}
      DirectionalLight {{ ambientIntensity 0.25 intensity 3 direction {words(sensor.position - light)} }}"""
    eye = SENSOR.replace("NAME", f'eye" occlusion {occlusion} model "')
    simulation = setting.load(lights + nodes + robot(eye + part))
    enable(simulation)
    move(simulation, "R", pose)
    simulation.step(STEP_MS)
    direct = 5.0 * facing(sensor, np.array(light - sensor.position))
    return device(simulation, "eye").value, np.array([0.75, direct]) * FILTER.sum() / 3.0


def nothing(_sensor, _light):
    """Hide nothing."""
    return "", ""


def between(sensor, light):
    """Put a ball between sensor and light."""
    return BALL % words((sensor + light) / 2.0), ""


def next_to_it(sensor, light):
    """Put a ball next to the line from sensor to light."""
    aside = np.cross(light - sensor, [1.0, 2.0, 3.0])
    return BALL % words((sensor + light) / 2.0 + 0.3 * aside / np.linalg.norm(aside)), ""


def behind(sensor, light):
    """Put a ball behind the light; the DirectionalLight shines from farther away, so the ball hides it."""
    return BALL % words(light + (light - sensor)), ""


def own_part(_sensor, _light):
    """Enclose the sensor in a part of its own robot."""
    return "", 'Solid { name "hull" boundingObject Sphere { radius 0.6 } }'


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize(
    ("hiding", "share"),
    [(nothing, 1.0), (between, 0.0), (next_to_it, 1.0), (behind, 0.4)],
)
def test_a_shape_in_front_of_a_light_hides_its_direct_light(setting, hiding, share):
    """In Webots, a hidden light still contributes its ambient light."""
    value, (ambient, direct) = shaded(setting, (2.0, 0.5, 0.3), hiding)

    assert direct > 1.0
    assert value == pytest.approx(ambient + share * direct, rel=1e-6)


@pytest.mark.parametrize("setting", [it for it in SETTINGS if it.system == "ENU"], ids=str)
def test_a_part_of_the_same_robot_hides_no_light(setting):
    """As in Webots without `selfCollision`, a sensor inside a hull sees more than the ambient light."""
    value, (ambient, direct) = shaded(setting, (2.0, 0.5, 0.3), own_part)

    assert value == pytest.approx(ambient + direct, rel=1e-6)


def test_without_occlusion_no_shape_hides_a_light():
    """FALSE is the default value, because a ray for each light costs time."""
    value, (ambient, direct) = shaded(SETTINGS[0], (2.0, 0.5, 0.3), between, occlusion="FALSE")

    assert value == pytest.approx(ambient + direct, rel=1e-6)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_floor_hides_the_lights_below_it(setting):
    """The sensor looks down through the floor; a Plane has no shape that rays could meet."""
    down = MOUNT.rotation.T @ POSES[3].rotation.T @ [0.3, 0.0, -2.0]
    way = np.array([abs(down[0]), down[1], down[2]])
    value, (ambient, direct) = shaded(
        setting, way, lambda _sensor, _light: (FLOOR % words(axis_angle(setting.axes)), "")
    )

    assert direct >= 0.0
    assert value == pytest.approx(ambient, rel=1e-6)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_shape_that_moves_away_lets_the_light_pass(setting):
    """A supervisor or the physics may move a shape at any time."""
    pose = setting.put(POSES[3])
    sensor = pose @ MOUNT
    light = sensor.position + sensor.rotation @ (2.0, 0.5, 0.3)
    eye = SENSOR.replace("NAME", 'eye" occlusion TRUE model "')
    lamp = f"PointLight {{ intensity 2 location {words(light)} }}"
    simulation = setting.load(lamp + BALL % words((sensor.position + light) / 2.0) + robot(eye))
    enable(simulation)
    move(simulation, "R", pose)
    simulation.step(STEP_MS)
    before = device(simulation, "eye").value
    move(simulation, "BALL", setting.put(frame((9.0, 9.0, 0.1))))
    simulation.step(STEP_MS)

    assert before == 0.0
    assert device(simulation, "eye").value > 0.5


def test_a_light_that_a_supervisor_switches_on_is_seen():
    """The sensor reads the light's fields at each step, so a change counts at once."""
    simulation = SETTINGS[0].load(LIGHTS[dark] + robot(SENSOR.replace("NAME", "eye")))
    enable(simulation)
    simulation.step(STEP_MS)
    before = device(simulation, "eye").value

    lamp = simulation.tree.of_def("LAMP")
    simulation.tree.field_of(lamp, "ambientIntensity", simulation).set(FieldType.FLOAT, 0, 0.5)
    simulation.tree.field_of(lamp, "on", simulation).set(FieldType.BOOL, 0, True)
    simulation.step(STEP_MS)

    assert before == 0.0
    assert device(simulation, "eye").value >= 0.5 * FILTER.sum() / 3.0


def test_a_light_that_a_supervisor_adds_is_seen():
    """The sensor measures the added light until a reset removes it."""
    simulation = SETTINGS[0].load("DEF G Group { }" + robot(SENSOR.replace("NAME", "eye")))
    enable(simulation)
    place = simulation.tree.field_of(simulation.tree.of_def("G"), "children", simulation)
    values = []
    for change in (lambda: None, lambda: simulation.add(LIGHTS[point], place, 0), simulation.reset):
        change()
        simulation.step(STEP_MS)
        values.append(device(simulation, "eye").value)

    assert values[0] == values[2] == 0.0
    assert values[1] >= 0.5 * FILTER.sum() / 3.0


@pytest.mark.parametrize(
    ("world", "fields", "fact"),
    [
        ("FloorLight { }", "", "a FloorLight, whose light is not simulated"),
        ("CeilingLight { }", "", "a CeilingLight, whose light is not simulated"),
        ('TexturedBackgroundLight { texture "dusk" }', "", "the texture dusk, whose light is not simulated"),
    ],
)
def test_what_a_light_sensor_cannot_measure_is_refused(world, fields, fact):
    """Reading 0 for an unsupported light would be a wrong value without an error."""
    with pytest.raises(WorldError, match=fact):
        SETTINGS[0].load(world + robot(SENSOR.replace("NAME", f'eye" {fields} model "')))
