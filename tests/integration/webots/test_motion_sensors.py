"""The facades of sensors of place, motion and environment, compared with formulas in each simulator."""

import math

import pytest

from palaestra_trainer.errors import ConfigurationError, WorldMisfit
from palaestra_trainer.webots import (
    GPS,
    Accelerometer,
    Altimeter,
    Compass,
    GPSSpeed,
    GPSVelocity,
    Gyro,
    InertialUnit,
    JointMotor,
    LaserScan,
    LightSensor,
)
from tests.integration.webots.own_world import OwnRobot, running
from tests.values.frames import axis_angle, frame
from tests.values.standing import GRAVITY, MOUNT, POSES, REFERENCE, ROWS
from tests.values.worlds import PHYSICS, Setting, robot

FACADES = {
    "accelerometer": Accelerometer,
    "altimeter": Altimeter,
    "compass": Compass,
    "gps": GPS,
    "gyro": Gyro,
    "inertial unit": InertialUnit,
    "light sensor": LightSensor,
}
MEASURED = {row.name: row for row in ROWS if row.name in FACADES}


class Measuring(OwnRobot):
    """A robot with one sensor of each facade; one axis of another compass is switched off in the world."""

    definition = "R"

    def equip(self):
        """Add the sensors."""
        self.sensors = {name: facade(self.node_name, name) for name, facade in FACADES.items()}
        self.flat = Compass(self.node_name, "compass axes", axes="xz")
        self.simulation.add([*self.sensors.values(), self.flat], [])


@pytest.fixture(scope="module", params=PHYSICS)
def measured(request, master, tmp_path_factory):
    """Yield a setting, a robot after one step at a tilted pose, and the frame of its sensors."""
    del master
    setting = Setting(request.param)
    rows = [*MEASURED.values(), next(row for row in ROWS if row.name == "compass axes")]
    sensors = " ".join(row.node.format(place=f'name "{row.name}" {MOUNT.fields}') for row in rows)
    info = "gravity {} gpsReference {} {} {}".format(GRAVITY, *REFERENCE)
    text = setting.text(robot(sensors, POSES[0].fields), info)
    with running(text, tmp_path_factory.mktemp("world"), request.param, Measuring) as (_, measuring):
        yield setting, measuring, POSES[0] @ MOUNT


@pytest.mark.parametrize("name", FACADES)
def test_a_facade_reads_what_the_formula_gives(measured, name):
    """The author of an environment reads the same value with each simulator."""
    setting, measuring, sensor = measured
    expected = MEASURED[name].formula(sensor, setting)

    value = measuring.sensors[name].value

    assert value == pytest.approx(expected if len(expected) > 1 else expected[0], abs=1e-6)


def test_an_axis_that_is_switched_off_is_left_out(measured):
    """The simulator sends NaN for this axis, and the trainer takes NaN for a fault of the simulator."""
    setting, measuring, sensor = measured
    north = sensor.rotation.T @ setting.north

    assert measuring.flat.value == pytest.approx([north[0], north[2]], abs=1e-6)


def test_the_angles_of_an_inertial_unit_are_those_of_its_quaternion(measured):
    """Rotations about x, then y, then z by these angles give the sensor's rotation again."""
    _, measuring, sensor = measured
    turns = [
        frame(axis=axis, angle_rad=angle).rotation
        for axis, angle in zip(
            ((1, 0, 0), (0, 1, 0), (0, 0, 1)), measuring.sensors["inertial unit"].roll_pitch_yaw, strict=True
        )
    ]

    again = turns[2] @ turns[1] @ turns[0]

    assert axis_angle(again.T @ sensor.rotation)[3] == pytest.approx(0.0, abs=1e-6)


def test_before_the_first_step_an_inertial_unit_has_no_angles():
    """The sensor has not measured yet, and angles of 0 would be a wrong reading."""
    assert InertialUnit("r", "inertial unit").roll_pitch_yaw is None


@pytest.mark.parametrize("axes", ["", "xw", "X"])
def test_unknown_axes_are_refused(axes):
    """Without the error, a misspelled axis would shorten the reading, and so change the observation."""
    with pytest.raises(ConfigurationError, match="are not letters of xyz"):
        Gyro("r", "gyro", axes=axes)


def test_the_light_sensor_reads_a_number(measured):
    """A message of the light sensor has a variance too; the variance is not part of the reading."""
    _, measuring, _ = measured

    assert isinstance(measuring.sensors["light sensor"].value, float)
    assert math.isfinite(measuring.sensors["light sensor"].value)


SPEED_M_S = 0.2
TURNED = frame((1.0, 2.0, 0.5), (0.0, 0.0, 1.0), 0.5)
SLIDE = """SliderJoint { jointParameters JointParameters { axis 0 1 0 } device LinearMotor { name "slide" }
  endPoint Solid { children [ GPS { name "gps" } ] physics Physics { density -1 mass 1 } } }"""


class Sliding(OwnRobot):
    """A robot that moves its GPS along its y axis."""

    definition = "R"

    def equip(self):
        """Add the motor, and what the GPS measures of its motion."""
        name = self.node_name
        self.slide = JointMotor(name, "slide", "velocity")
        self.speed, self.velocity = GPSSpeed(name, "gps"), GPSVelocity(name, "gps")
        self.simulation.add([self.speed, self.velocity], [self.slide])


@pytest.mark.parametrize("driver", PHYSICS)
def test_a_gps_measures_the_velocity_in_the_axes_of_the_world(master, tmp_path, driver):
    """The robot is turned by 0.5 rad, so a velocity in its own axes would have other values."""
    del master
    text = Setting(driver).text(robot(SLIDE, TURNED.fields), "gravity 0")
    with running(text, tmp_path, driver, Sliding) as (_, sliding):
        sliding.slide.set(SPEED_M_S)
        for _ in range(10):
            sliding.advance()
        speed, velocity = sliding.speed.value, sliding.velocity.value

    expected = [SPEED_M_S * -math.sin(0.5), SPEED_M_S * math.cos(0.5), 0.0]
    assert speed == pytest.approx(SPEED_M_S, abs=1e-3)
    assert velocity == pytest.approx(expected, abs=1e-3)


GLOBE = 'gpsCoordinateSystem "WGS84" gpsReference 46.5 6.5 400'


class Located(OwnRobot):
    """A robot with a GPS, and with a lidar of several layers that a test adds later."""

    definition = "R"

    def equip(self):
        """Add the GPS."""
        self.gps = GPS(self.node_name, "gps")
        self.simulation.add([self.gps], [])


@pytest.mark.parametrize("driver", PHYSICS)
def test_a_gps_on_the_globe_is_read_in_degrees(master, tmp_path, driver):
    """In such a world, Webots publishes another type of message. The GPS here is at `gpsReference`."""
    del master
    text = Setting(driver).text(robot('GPS { name "gps" } Lidar { name "lidar" numberOfLayers 2 }'), GLOBE)
    with running(text, tmp_path, driver, Located) as (_, located):
        located.advance()
        geographic, (latitude, longitude, altitude) = located.gps.geographic, located.gps.value
        scan = LaserScan(located.node_name, "lidar")
        with pytest.raises(WorldMisfit, match="lidar has 2 layers, and only a lidar with one layer"):
            located.simulation.use(scan)
        located.connect()  # a second time, as after a restart
        located.advance()

    assert geographic
    assert (latitude, longitude) == pytest.approx((46.5, 6.5), abs=1e-6)
    assert altitude == pytest.approx(400.0)
    assert located.gps.value[0] == pytest.approx(46.5, abs=1e-6)
