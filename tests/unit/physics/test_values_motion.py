"""Driving robots and their motion sensors, compared with formulas for wheels that roll without slip."""

import math

import numpy as np
import pytest

from tests.values.frames import frame
from tests.values.standing import GRAVITY, MOUNT
from tests.values.worlds import SETTINGS, STEP_MS, cached, device, move, robot

STEP_S = STEP_MS / 1000.0
RADIUS_M = 0.05
UP = np.array([0.0, 0.0, 1.0])
SENSORS = f"""
GPS {{ name "gps" {MOUNT.fields} }} Gyro {{ name "gyro" {MOUNT.fields} }}
Accelerometer {{ name "accelerometer" {MOUNT.fields} }}
"""
STARTS = [
    frame((0.0, 0.0, 0.0)),
    frame((3.0, -2.0, 0.2), angle_rad=1.3),
    frame((-7.0, 4.0, -1.0), angle_rad=-2.9),
]


def wheel(name, hub, azimuth_rad):
    """Return a wheel with a motor and a position sensor; its axle points to an azimuth."""
    c, s = math.cos(azimuth_rad), math.sin(azimuth_rad)
    x, y = hub
    return f"""HingeJoint {{
      jointParameters HingeJointParameters {{ axis {c:.15g} {s:.15g} 0 anchor {x:.15g} {y:.15g} {RADIUS_M} }}
      device [ RotationalMotor {{ name "{name}" maxVelocity 100 }} PositionSensor {{ name "{name} sensor" }} ]
      endPoint Solid {{ translation {x:.15g} {y:.15g} {RADIUS_M} rotation 0 0 1 {azimuth_rad:.15g}
        boundingObject Pose {{ rotation 1 0 0 1.5707963267948966
          children [ Cylinder {{ radius {RADIUS_M} height 0.02 }} ] }} }} }}"""


# Each wheel: the position of its hub in the frame of the robot, and the azimuth of its axle.
TWO = [((0.03, 0.12), math.pi / 2.0), ((0.03, -0.12), math.pi / 2.0)]
THREE = [
    ((0.2 * math.cos(azimuth), 0.2 * math.sin(azimuth)), azimuth)
    for azimuth in (math.pi, -math.pi / 3.0, math.pi / 3.0)
]
BASES = {"two wheels": TWO, "three wheels": THREE}
COMMANDS = {  # speeds of the wheels in rad/s
    "two wheels": [(6.0, 6.0), (2.0, 5.0), (-3.0, 3.0)],
    "three wheels": [(0.0, -5.0, 5.0), (4.0, -1.0, 2.0), (3.0, 3.0, 3.0)],
}


def twist(wheels, speeds):
    """Return the robot's vx, vy in m/s and omega in rad/s, in its own frame.

    The hub of each wheel moves in its rolling direction at radius times wheel speed. Two wheels on one axle
    cannot slide along that axle.
    """
    rows, values = [], []
    for ((x, y), azimuth), speed in zip(wheels, speeds, strict=True):
        along = np.array([math.sin(azimuth), -math.cos(azimuth)])
        rows.append([*along, along @ [-y, x]])
        values.append(RADIUS_M * speed)
    if len(wheels) == len(TWO):
        rows.append([0.0, 1.0, wheels[0][0][0]])
        values.append(0.0)
    return np.linalg.solve(rows, values)


def after(start, moved, time_s):
    """Return the frame of a robot that has moved with a twist in its own frame."""
    vx, vy, omega = moved
    turned = omega * time_s
    if abs(omega) < 1e-12:
        way = np.array([vx, vy, 0.0]) * time_s
    else:
        arc = np.array(
            [[math.sin(turned), math.cos(turned) - 1.0], [1.0 - math.cos(turned), math.sin(turned)]]
        )
        way = np.array([*(arc @ [vx, vy] / omega), 0.0])
    return start @ frame(way, angle_rad=turned or 1e-15)


def velocity(pose, moved):
    """Return the velocity in m/s of the point where the sensors are mounted, in the axes of the ground."""
    vx, vy, omega = moved
    return pose.rotation @ (np.array([vx, vy, 0.0]) + omega * np.cross(UP, MOUNT.position))


@cached
def simulation_of(setting, base):
    """Return a simulation of a robot on these wheels."""
    wheels = " ".join(wheel(f"wheel {index}", *it) for index, it in enumerate(BASES[base]))
    body = f"physics Physics {{ }} {setting.put(frame()).fields}"
    return setting.load(robot(wheels + SENSORS, body), f"gravity {GRAVITY}")


def drive(simulation, start, speeds):
    """Put the robot at a pose, drive until the wheels have these speeds, and return the wheel angles."""
    move(simulation, "R", start)
    for index, speed in enumerate(speeds):
        motor = device(simulation, f"wheel {index}")
        motor.set_position(math.inf)
        motor.set_velocity(speed)
    simulation.step(100 * STEP_MS)
    return [device(simulation, f"wheel {index} sensor").value for index in range(len(speeds))]


def here(simulation, setting):
    """Return the pose of the robot in the axes of the ground."""
    place = simulation.tree.of_def("R").place
    *axis, angle_rad = place.rotation
    posed = frame(place.translation, axis, angle_rad or 1e-15)
    back = setting.axes.T
    return frame(back @ posed.position, UP, math.atan2(*(back @ posed.rotation[:, 0])[1::-1]))


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("base", BASES)
def test_wheels_take_a_robot_where_they_roll(base, setting):
    """From every start the robot follows the arc of the formula.

    The wheel sensors measure how far the wheels turned.
    """
    simulation = simulation_of(setting, base)
    for start, speeds in zip(STARTS, COMMANDS[base], strict=True):
        angles = drive(simulation, setting.put(start), speeds)
        before = here(simulation, setting)
        simulation.step(50 * STEP_MS)

        time_s = 50 * STEP_S
        expected = after(before, twist(BASES[base], speeds), time_s)
        found = here(simulation, setting)
        assert found.position == pytest.approx(expected.position, abs=1e-3), speeds
        assert found.rotation == pytest.approx(expected.rotation, abs=1e-3), speeds
        for index, (angle, speed) in enumerate(zip(angles, speeds, strict=True)):
            read = device(simulation, f"wheel {index} sensor").value
            assert read == pytest.approx(angle + speed * time_s), speeds


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("base", BASES)
def test_sensors_of_motion_read_what_the_circle_gives(base, setting):
    """The robot drives along a circle at a constant speed.

    The sensors are rotated, and mounted off the robot's center.
    """
    simulation = simulation_of(setting, base)
    for start, speeds in zip(STARTS, COMMANDS[base], strict=True):
        drive(simulation, setting.put(start), speeds)
        moved = twist(BASES[base], speeds)
        now = here(simulation, setting)
        before = after(now, moved, -STEP_S)
        sensor = now @ MOUNT
        speed = velocity(now, moved)
        gained = (speed - velocity(before, moved)) / STEP_S + GRAVITY * UP
        gps = device(simulation, "gps")

        assert gps.value == pytest.approx(setting.axes @ sensor.position, abs=1e-6), speeds
        assert gps.speed_vector.value == pytest.approx(setting.axes @ speed, abs=2e-3), speeds
        assert gps.speed.value == pytest.approx(np.linalg.norm(speed), abs=2e-3), speeds
        turning = sensor.rotation.T @ (moved[2] * UP)
        assert device(simulation, "gyro").value == pytest.approx(turning, abs=2e-3), speeds
        felt = sensor.rotation.T @ gained
        assert device(simulation, "accelerometer").value == pytest.approx(felt, abs=0.01), speeds


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_battery_loses_the_power_of_the_robot_times_the_time(setting):
    """The loss is in joules. This robot has no motors, and an empty battery stays empty."""
    body = "battery [ 50 60 10 ] cpuConsumption 7"
    simulation = setting.load(robot("", body))
    for steps in (10, 100, 1000):
        before = simulation.robots[0].battery.value
        simulation.step(steps * STEP_MS)
        expected = max(0.0, before - 7.0 * steps * STEP_S)
        assert simulation.robots[0].battery.value == pytest.approx(expected, abs=1e-9)


BUMPER = """TouchSensor { name "bumper" type "bumper" translation 0.1 0 0.2
  boundingObject Cylinder { radius 0.2 height 0.1 } }"""


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_a_bumper_touches_a_wall_where_its_rim_reaches_it(setting):
    """The rim is 0.3 m from the robot's center.

    A wall at 0.299 m touches the rim, and a wall at 0.301 m does not.
    """
    wheels = " ".join(wheel(f"wheel {index}", *it) for index, it in enumerate(TWO))
    wall = 'DEF WALL Solid { name "wall" boundingObject Box { size 0.2 2 1 } }'
    simulation = setting.load(robot(wheels + BUMPER, setting.put(frame()).fields) + wall)
    for start in STARTS:
        for gap, touches in ((0.001, False), (-0.001, True)):
            move(simulation, "R", setting.put(start))
            move(simulation, "WALL", setting.put(start @ frame((0.4 + gap, 0.0, 0.2))))
            simulation.step(STEP_MS)
            assert device(simulation, "bumper").value is touches, (start, gap)
