"""Motors, brakes and joints: poses of parts and readings of sensors, compared with formulas."""

import math

import numpy as np
import pytest

from tests.values.frames import Frame, frame, quaternion, turn
from tests.values.shapes import FILES, SHAPES
from tests.values.standing import MOUNT, POSES
from tests.values.worlds import SETTINGS, STEP_MS, Setting, cached, device, move, robot

STEP_S = STEP_MS / 1000.0
AXIS = np.array([0.36, 0.48, 0.8])
ANCHOR = np.array([0.1, -0.2, 0.3])
END = frame((0.4, 0.1, 0.2), (0.0, 0.6, 0.8), 0.5)  # the pose of the end of each joint in the file
BEGIN = {"hinge": 0.4, "slider": 0.15}  # the position of each joint in the file
SENSORS = """GPS {{ name "{0} gps" {1} }} Gyro {{ name "{0} gyro" {1} }}
  InertialUnit {{ name "{0} unit" {1} }}"""
PARTS = f"""
HingeJoint {{
  jointParameters HingeJointParameters {{ axis {AXIS[0]} {AXIS[1]} {AXIS[2]} position {BEGIN["hinge"]}
    anchor {ANCHOR[0]} {ANCHOR[1]} {ANCHOR[2]} }}
  device [ RotationalMotor {{ name "hinge" maxVelocity 5 maxTorque 100 }}
    PositionSensor {{ name "hinge sensor" }} ]
  endPoint Solid {{ {END.fields} children [ {SENSORS.format("hinge", MOUNT.fields)} ] }} }}
SliderJoint {{
  jointParameters JointParameters {{ axis {AXIS[0]} {AXIS[1]} {AXIS[2]} position {BEGIN["slider"]} }}
  device [ LinearMotor {{ name "slider" maxVelocity 5 maxForce 100 }}
    PositionSensor {{ name "slider sensor" }} ]
  endPoint Solid {{ {END.fields} name "carriage" children [ {SENSORS.format("slider", MOUNT.fields)} ] }} }}
"""
JOINTS = ("hinge", "slider")


def sensor_at(base, joint, position):
    """Return the frame of the sensors on a joint at a position; `base` is the frame of the robot."""
    moved = position - BEGIN[joint]
    if joint == "slider":
        return base @ frame(moved * AXIS) @ END @ MOUNT
    turned = turn(AXIS, moved)
    return base @ Frame(ANCHOR - turned @ ANCHOR, turned) @ END @ MOUNT


@cached
def simulation_of(setting):
    """Return a simulation of a robot with a hinge and a slider."""
    return setting.load(robot(PARTS))


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("joint", JOINTS)
def test_a_motor_puts_the_end_of_its_joint_where_the_formula_says(joint, setting):
    """A hinge turns its end about the axis through the anchor. A slider moves its end along the axis.

    The robot may lean.
    """
    simulation = simulation_of(setting)
    for pose, target in zip(POSES, (1.3, -0.7, BEGIN[joint], 2.0), strict=True):
        move(simulation, "R", setting.put(pose))
        device(simulation, joint).set_position(target)
        device(simulation, joint).set_velocity(5.0)
        simulation.step(200 * STEP_MS)

        sensor = sensor_at(setting.put(pose), joint, target)
        assert device(simulation, f"{joint} sensor").value == pytest.approx(target, abs=2e-6)
        assert device(simulation, f"{joint} gps").value == pytest.approx(sensor.position, abs=1e-5)
        assert device(simulation, f"{joint} unit").value == pytest.approx(
            quaternion(sensor.rotation), abs=1e-5
        )


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("joint", JOINTS)
def test_a_motor_at_a_velocity_moves_its_end_by_the_formula(joint, setting):
    """The GPS, the gyro and the position sensor on the end read the values of the formula."""
    simulation = simulation_of(setting)
    motor = device(simulation, joint)
    for pose, speed in zip(POSES, (0.5, -1.0, 2.0, -0.3), strict=True):
        move(simulation, "R", setting.put(pose))
        motor.set_position(math.inf)
        motor.set_velocity(speed)
        simulation.step(30 * STEP_MS)
        before = device(simulation, f"{joint} sensor").value
        simulation.step(5 * STEP_MS)

        position = before + 5 * STEP_S * speed
        base = setting.put(pose)
        sensor = sensor_at(base, joint, position)
        arm = sensor.position - base @ ANCHOR
        turning = speed * (base.rotation @ AXIS) if joint == "hinge" else np.zeros(3)
        velocity = np.cross(turning, arm) if joint == "hinge" else speed * (base.rotation @ AXIS)
        assert device(simulation, f"{joint} sensor").value == pytest.approx(position)
        assert device(simulation, f"{joint} gps").value == pytest.approx(sensor.position)
        assert device(simulation, f"{joint} gps").speed_vector.value == pytest.approx(velocity)
        assert device(simulation, f"{joint} gyro").value == pytest.approx(sensor.rotation.T @ turning)


HEAVY = """
HingeJoint {{
  jointParameters HingeJointParameters {{ axis {axis} }}
  device [ RotationalMotor {{ name "turn" maxTorque 20 maxVelocity 100 }} Brake {{ name "brake" }}
    PositionSensor {{ name "angle" }} ]
  endPoint Solid {{ translation {away} boundingObject Box {{ size 0.2 0.3 0.4 }}
    physics Physics {{ density -1 mass 8 }} }} }}
SliderJoint {{
  jointParameters JointParameters {{ axis 0.6 0.8 0 }}
  device [ LinearMotor {{ name "push" maxForce 100 maxVelocity 100 }} PositionSensor {{ name "way" }} ]
  endPoint Solid {{ translation 0 0 -0.5 name "load" boundingObject Box {{ size 0.1 0.1 0.1 }}
    physics Physics {{ density -1 mass 3 }} }} }}
"""
# The axis of the hinge, the center of its end, and the moment of inertia about the axis in kg m2.
BOXES = [
    ("0 0 1", "0 0 0.5", 8.0 / 12.0 * (0.2**2 + 0.3**2)),
    ("0 0 -1", "0.5 0 0.5", 8.0 / 12.0 * (0.2**2 + 0.3**2) + 8.0 * 0.5**2),
    ("0 0 1", "-0.3 0.4 0.5", 8.0 / 12.0 * (0.2**2 + 0.3**2) + 8.0 * 0.5**2),
]


@pytest.mark.parametrize(("axis", "away", "inertia"), BOXES)
def test_a_torque_and_a_force_speed_up_what_they_move(axis, away, inertia):
    """MuJoCo only: the distance is half the acceleration times the time squared.

    The stub rejects torques and forces.
    """
    base = "translation 0 0 1 boundingObject Box { size 0.1 0.1 0.1 }"
    simulation = Setting("mujoco").load(robot(HEAVY.format(axis=axis, away=away), base))
    device(simulation, "turn").set_effort(1.5)
    device(simulation, "push").set_effort(-2.0)
    for steps in (10, 20, 20):
        simulation.step(steps * STEP_MS)
    time_s = 50 * STEP_S

    assert device(simulation, "angle").value == pytest.approx(1.5 / inertia * time_s**2 / 2.0, rel=0.01)
    assert device(simulation, "way").value == pytest.approx(-2.0 / 3.0 * time_s**2 / 2.0, rel=0.01)
    assert device(simulation, "turn").speed_rad_s == pytest.approx(1.5 / inertia * time_s, rel=1e-3)


SLEDGE = """SliderJoint {{
  jointParameters JointParameters {{ axis 0.6 0.8 0 }}
  device [ LinearMotor {{ name "push" maxForce 1000 maxVelocity 100 }} PositionSensor {{ name "way" }} ]
  endPoint Solid {{ translation 0 0 5 boundingObject {} physics Physics {{ density 200 }} }} }}"""


@pytest.mark.parametrize("shape", [it for it in SHAPES if it.volume_m3], ids=str)
def test_a_shape_has_the_mass_of_its_volume(shape):
    """MuJoCo only: 100 N accelerate the shape as its volume at 200 kg/m3 requires.

    Its convex hull would be heavier.
    """
    base = "translation 0 0 1 boundingObject Box { size 0.1 0.1 0.1 }"
    simulation = Setting("mujoco").load(robot(SLEDGE.format(shape.node), base), files=FILES)
    device(simulation, "push").set_effort(100.0)
    simulation.step(50 * STEP_MS)

    speed = 100.0 / (200.0 * shape.volume_m3) * 50 * STEP_S
    assert device(simulation, "push").speed_rad_s == pytest.approx(speed, rel=1e-3)


@pytest.mark.parametrize("damping", [0.5, 2.0, 8.0])
@pytest.mark.parametrize("physics", ["stub", "mujoco"])
def test_a_brake_limits_a_motor_to_its_torque_over_the_damping(physics, damping):
    """At the limit the damper takes the motor's whole 20 N m. A slower command is not limited."""
    axis, away, _ = BOXES[0]
    base = "translation 0 0 1 boundingObject Box { size 0.1 0.1 0.1 }"
    simulation = Setting(physics).load(robot(HEAVY.format(axis=axis, away=away), base))
    motor, brake = device(simulation, "turn"), simulation.robots[0].parts.devices.rows["brake"]
    services = {path: handler for path, _, handler in brake[0].services(brake[1])}
    services["set_damping_constant"](type("Request", (), {"value": damping}))
    motor.set_position(math.inf)
    motor.set_velocity(15.0)
    simulation.step(300 * STEP_MS)

    assert motor.speed_rad_s == pytest.approx(min(15.0, 20.0 / damping), rel=1e-3)


SCALE = """TouchSensor {{ name "plate" type "{kind}" lookupTable [ ] translation 0 0 0.5 {rotation}
  boundingObject Box {{ size 0.1 0.1 0.1 }} physics Physics {{ density -1 mass 2 }} }}"""
TURNS = [
    frame(axis=(0, 1, 0), angle_rad=-1.2),
    frame(axis=(0.6, 0, 0.8), angle_rad=2.0),
    frame(axis=(0, 1, 0.2), angle_rad=1.4),
]


@pytest.mark.parametrize("mounted", TURNS, ids=lambda it: it.fields[20:])
def test_a_sensor_of_force_measures_its_own_weight_in_its_own_axes(mounted):
    """MuJoCo only: `force-3d` reads the weight in the sensor's frame.

    `force` reads only the pressure along the x axis.
    """
    weight = mounted.rotation.T @ [0.0, 0.0, -2.0 * 9.81]
    rotation = mounted.fields.partition("rotation")[2]
    for kind, expected in (("force-3d", weight), ("force", [max(0.0, -weight[0])])):
        plate = SCALE.format(kind=kind, rotation=f"rotation {rotation}")
        simulation = Setting("mujoco").load(robot(plate, "boundingObject Box { size 0.5 0.5 0.2 }"))
        simulation.step(10 * STEP_MS)
        assert np.atleast_1d(device(simulation, "plate").value) == pytest.approx(expected, abs=1e-6), kind
