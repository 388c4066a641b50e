"""Sensors with several rays, and pictures, at a wall: averages, colors and pixels compared with formulas."""

import math
from functools import partial

import numpy as np
import pytest

from tests.values import rays
from tests.values.frames import frame, looking, quaternion, turn
from tests.values.standing import MOUNT
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, enable, move, robot

REACH_M = 8.0
SIZE = (0.4, 30.0, 30.0)
WALL = frame((20.0, 5.0, 40.0), (0, 0, 1), 0.5)  # in the axes of the ground
APERTURE_RAD, WIDTH = 0.5, 0.6
SENSITIVITY = 0.7
RED, ROUGHNESS, TRANSPARENCY = 0.6, 0.5, 0.25
LIGHT = 0.2 + 0.8 * RED * (1.0 - TRANSPARENCY) * (1.0 - ROUGHNESS / 2.0)
DISTANCE = f"""DistanceSensor {{ name "NAME" {MOUNT.fields} type "TYPE" numberOfRays 5 aperture {APERTURE_RAD}
  gaussianWidth {WIDTH} lookupTable [ 0 100 0, {REACH_M} 900 0 ] FIELDS }}"""
TYPES = {
    "generic": ("generic", ""),
    "laser": ("laser", ""),
    "sonar": ("sonar", ""),
    "infra-red": ("infra-red", ""),
    "sensitive": ("infra-red", f"redColorSensitivity {SENSITIVITY}"),
    "coarse": ("generic", "resolution 25"),
}
NOTHING = f'DistanceSensor {{ name "nothing" {MOUNT.fields} lookupTable [ ] }}'
# The poses of sensors and the points at which they look, in the frame of the wall.
LOOKS = [
    looking((2.0, 0.3, -0.4), (0.2, 0.3, -0.4), 0.3),
    looking((2.5, 1.0, 0.5), (0.2, 0.8, 0.7), 1.1),
    looking((1.5, -2.0, 1.0), (0.2, -0.5, 0.0), -2.0),
    looking((3.0, 0.0, 3.0), (0.2, 4.0, 1.0), 0.0),
    looking((2.0, 0.0, 0.0), (4.0, 1.0, 1.0), 0.0),
]


@cached
def simulation_of(setting):
    """Return a simulation of a colored wall, and of a robot with a sensor of each type."""
    look = f"""appearance PBRAppearance {{
      baseColor {RED} 0.1 0.9 roughness {ROUGHNESS} transparency {TRANSPARENCY} }}"""
    shape = f"Box {{ size {SIZE[0]} {SIZE[1]} {SIZE[2]} }}"
    wall = f"""Solid {{ {setting.put(WALL).fields} children [ Shape {{ {look} geometry {shape} }} ]
      boundingObject {shape} }}"""
    sensors = " ".join(
        DISTANCE.replace("NAME", name).replace("TYPE", kind).replace("FIELDS", fields)
        for name, (kind, fields) in TYPES.items()
    )
    return setting.load(wall + robot(sensors + NOTHING))


def directions():
    """Return the five rays of a sensor, (5, 3): its axis, and one to each side at half the aperture."""
    half = APERTURE_RAD / 2.0
    return [np.array([1.0, 0.0, 0.0])] + [
        turn([1, 0, 0], q) @ [math.cos(half), math.sin(half), 0.0] for q in np.arange(4) * math.pi / 2.0
    ]


def distances(sensor, ways):
    """Return the distances of rays from a frame to the wall, and the angle of each to its normal."""
    met = [min(rays.box(sensor.position, sensor.rotation @ way, SIZE), REACH_M) for way in ways]
    off = [np.arccos(abs((sensor.rotation @ way)[0])) for way in ways]
    return np.array(met), np.array(off)


def expected(name, sensor):
    """Return the measurement of a sensor of that name in meters."""
    met, off = distances(sensor, directions())
    if name == "laser":
        return met[0]
    if name == "sonar":
        return min([REACH_M, *met[off < math.pi / 8.0]])
    weights = np.exp(-((np.array([0.0, *[APERTURE_RAD / 2.0] * 4]) / (APERTURE_RAD * WIDTH)) ** 2))
    weights /= weights.sum()
    average = met @ weights
    light = np.where(met < REACH_M, LIGHT, 1.0) @ weights
    if name == "infra-red":
        return average / light
    if name == "sensitive":
        return average + (average / light - average) * SENSITIVITY
    return average


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("name", TYPES)
def test_a_distance_sensor_measures_by_its_type(name, setting):
    """Each type of sensor combines its rays in another way.

    The value is the average, the single ray, the nearest echo, or the color-weighted average. Then the lookup
    table maps the value.
    """
    simulation = simulation_of(setting)
    for sensor in LOOKS:
        move(simulation, "R", setting.put(WALL @ sensor @ MOUNT.inverse))
        simulation.step(STEP_MS)
        value = np.interp(expected(name, sensor), [0.0, REACH_M], [100.0, 900.0])
        if name == "coarse":
            value = 25.0 * np.round(value / 25.0)
        assert device(simulation, name).value == pytest.approx(value, abs=0.01), sensor


ROUND_RAD, HIGH_RAD, TILT_RAD = 1.2, 0.5, -0.35
FREQUENCY_HZ, COLUMNS = 6.25, 20  # two columns a step
LIDAR = f"""Lidar {{ name "NAME" {MOUNT.fields} FIELDS numberOfLayers 4 fieldOfView {ROUND_RAD}
  verticalFieldOfView {HIGH_RAD} minRange 0.1 maxRange {REACH_M} }}"""
TURNING = f"""tiltAngle {TILT_RAD} type "rotating" horizontalResolution {COLUMNS}
  defaultFrequency {FREQUENCY_HZ}"""
FIXED = {"lidar": 0.0, "tilted": TILT_RAD}


@cached
def scanned(setting):
    """Return a simulation of the wall, and of a robot with three lidars of four layers."""
    shape = f"Shape {{ geometry Box {{ size {SIZE[0]} {SIZE[1]} {SIZE[2]} }} }}"
    five = "horizontalResolution 5"
    fields = {"lidar": five, "tilted": f"{five} tiltAngle {TILT_RAD}", "turning": TURNING}
    lidars = " ".join(LIDAR.replace("NAME", name).replace("FIELDS", it) for name, it in fields.items())
    simulation = setting.load(f"Solid {{ {setting.put(WALL).fields} children [ {shape} ] }}" + robot(lidars))
    enable(simulation)
    return simulation


def towards(left, up):
    """Return the direction at an azimuth and an elevation, from x ahead and z up."""
    return np.array([math.cos(up) * math.cos(left), math.cos(up) * math.sin(left), math.sin(up)])


def is_seen(lidar, layer, sensor, ways):
    """Compare a layer with the distances along its rays, and the layer's points with the ends of the rays."""
    met, _ = distances(sensor, ways)
    points = [way * far if far < REACH_M else [math.inf] * 3 for way, far in zip(ways, met, strict=True)]

    read = [min(each, REACH_M) for each in lidar.layers[layer]]
    assert read == pytest.approx(list(met), rel=1e-5), (lidar.name, sensor, layer)
    assert np.array(list(lidar.points(layer))) == pytest.approx(np.array(points), abs=1e-4)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("name", FIXED)
def test_each_ray_of_a_lidar_leaves_at_its_azimuth_and_elevation(setting, name):
    """The first layer is at the top of the vertical field of view, and the last layer at its bottom.

    The rays of a layer go from left to right, each in the middle of its pixel. A tilt turns all rays upwards
    about the y axis.
    """
    simulation = scanned(setting)
    upwards = turn([0, 1, 0], -FIXED[name])
    for sensor in LOOKS:
        move(simulation, "R", setting.put(WALL @ sensor @ MOUNT.inverse))
        simulation.step(STEP_MS)
        for layer, up in enumerate(HIGH_RAD * np.array([0.5, 1 / 6, -1 / 6, -0.5])):
            ways = [upwards @ towards(ROUND_RAD * it, up) for it in (0.4, 0.2, 0.0, -0.2, -0.4)]
            is_seen(device(simulation, name), layer, sensor, ways)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_rotating_lidar_sees_all_around_within_a_turn(setting):
    """The head of the lidar begins ahead and turns to the right. The tilt raises each of its rays."""
    simulation = scanned(setting)
    for sensor in LOOKS:
        move(simulation, "R", setting.put(WALL @ sensor @ MOUNT.inverse))
        simulation.step(STEP_MS * COLUMNS // 2)
        for layer, up in enumerate(TILT_RAD + HIGH_RAD * np.array([0.5, 1 / 6, -1 / 6, -0.5])):
            ways = [towards(-math.tau * (it + 0.5) / COLUMNS, up) for it in range(COLUMNS)]
            is_seen(device(simulation, "turning"), layer, sensor, ways)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_step_measures_the_part_that_the_head_of_a_lidar_passes(setting):
    """Rays that the head has not passed since the start, or since a reset of the world, read 0."""
    simulation = scanned(setting)
    lidar = device(simulation, "turning")
    simulation.reset()
    simulation.step(STEP_MS)

    for passed in (0, 2, 4):
        assert np.count_nonzero(np.array(lidar.layers), axis=1).tolist() == [passed] * 4
        assert all(lidar.layers[0][:passed])
        simulation.step(STEP_MS)

    lidar.enabled(0)
    simulation.step(STEP_MS)
    assert np.count_nonzero(lidar.layers[0]) == 6
    enable(simulation)


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_distance_sensor_without_a_lookup_table_measures_0(setting):
    """Other sensors without a lookup table return the measured value, but a distance sensor returns 0."""
    simulation = simulation_of(setting)
    kind, sensor = simulation.robots[0].parts.devices.rows["nothing"]
    simulation.step(STEP_MS)

    services = {path: handler for path, _, handler in kind.services(sensor)}
    assert sensor.value == 0.0
    assert services["get_lookup_table"](None) == {"value": []}


WIDTH_PX, HEIGHT_PX, VIEW_RAD = 8, 6, 0.9
EYES = f"""RangeFinder {{ name "depth" {MOUNT.fields} width {WIDTH_PX} height {HEIGHT_PX}
  fieldOfView {VIEW_RAD} minRange 0.3 maxRange {REACH_M} }}
Camera {{ name "camera" {MOUNT.fields} width 80 height 60 fieldOfView {VIEW_RAD}
  recognition Recognition {{ }} }}"""
BALL = frame((1.0, 0.0, 0.0), (0.3, 0.4, 0.5), 1.3)


@cached
def pictures_of(setting):
    """Return a simulation of a ball in front of a wall, and of a robot with cameras."""
    shape = f"Shape {{ geometry Box {{ size {SIZE[0]} {SIZE[1]} {SIZE[2]} }} }}"
    ball = f"""Solid {{ {setting.put(WALL @ BALL).fields} name "ball" model "ball" recognitionColors [ 1 0 0 ]
      children [ Shape {{ geometry Sphere {{ radius 0.1 }} }} ] }}"""
    wall = f"Solid {{ {setting.put(WALL).fields} children [ {shape} ] }}"
    simulation = setting.load(wall + ball + robot(EYES))
    enable(simulation)
    return simulation


def pixels():
    """Yield the row, column and direction of each pixel. A direction has length 1 along the lens axis."""
    half = math.tan(VIEW_RAD / 2.0)
    for row in range(HEIGHT_PX):
        for column in range(WIDTH_PX):
            left = half * (1.0 - (2 * column + 1) / WIDTH_PX)
            up = half * HEIGHT_PX / WIDTH_PX * (1.0 - (2 * row + 1) / HEIGHT_PX)
            yield row, column, np.array([1.0, left, up])


MUJOCO = [setting for setting in SETTINGS if setting.physics == "mujoco"]


@pytest.mark.parametrize("setting", MUJOCO, ids=str)
def test_a_pixel_of_a_range_finder_is_a_distance_along_the_lens(setting):
    """MuJoCo only: a pixel shows the wall or the ball, whichever is nearer. The stub renders nothing."""
    simulation = pictures_of(setting)
    ball = partial(rays.sphere, radius=0.1, center=BALL.position)
    for sensor in LOOKS[:4]:
        move(simulation, "R", setting.put(WALL @ sensor @ MOUNT.inverse))
        simulation.step(STEP_MS)
        image = np.frombuffer(device(simulation, "depth").value, np.float32).reshape(HEIGHT_PX, WIDTH_PX)
        for row, column, way in pixels():
            ahead = sensor.rotation @ way / np.linalg.norm(way)
            met = min(rays.box(sensor.position, ahead, SIZE), ball(sensor.position, ahead))
            depth = met / np.linalg.norm(way)
            aside = np.linalg.norm(np.cross(ahead, BALL.position - sensor.position))
            if abs(aside - 0.1) < 0.02:
                continue  # the edge of the ball, which is rendered with 20 corners
            assert image[row, column] == pytest.approx(depth if depth < REACH_M else math.inf, rel=2e-3)


@pytest.mark.parametrize("setting", MUJOCO, ids=str)
def test_a_camera_recognizes_an_object_where_it_is(setting):
    """MuJoCo only: the camera returns the object's pose in the camera's frame, and its middle in pixels."""
    simulation = pictures_of(setting)
    starts = [(2.0, 0.3, -0.4), (1.5, -1.0, 0.6), (3.0, 1.0, 1.0)]
    for roll, start in enumerate(starts):
        aim = np.add(BALL.position, [0.0, 0.1, -0.05])
        sensor = looking(start, aim, 0.7 * roll)
        move(simulation, "R", setting.put(WALL @ sensor @ MOUNT.inverse))
        simulation.step(STEP_MS)
        (seen,) = device(simulation, "camera").recognition.value
        inner = sensor.inverse @ BALL
        assert seen["position"] == pytest.approx(inner.position, abs=1e-6)
        facing = quaternion(inner.rotation)
        assert seen["orientation"] == pytest.approx(facing, abs=1e-6)
        scale = 40.0 / math.tan(VIEW_RAD / 2.0)
        ahead, left, up = inner.position
        middle = [40.0 - scale * left / ahead, 30.0 - scale * up / ahead, 0.0]
        assert seen["position_on_image"] == pytest.approx(middle, abs=1.5)
        assert seen["model"] == "ball"
