"""Actuators, sensors and cameras of a MuJoCo model become devices of Webots."""

import math

import numpy as np
import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.world.mjcf.elements import Element
from tests.unit.mjcf.conftest import FORCE, POSITION, VELOCITY


def kinds(simulation):
    """Return the node type of each device by the device's name."""
    return {name: kind.node for name, (kind, _) in simulation.robots[0].parts.devices.rows.items()}


def value(simulation, name):
    """Return the value of a sensor."""
    return simulation.robots[0].sensors[name].value


def test_every_actuator_sensor_and_camera_is_a_device(load):
    """The author of a model need not list its devices.

    A sensor without a name is named after its joint and its type.
    """
    assert kinds(load()) == {
        "push": "LinearMotor",
        "cart position": "PositionSensor",
        "cart speed": "PositionSensor",
        "hinge_jointpos": "PositionSensor",
        "down": "DistanceSensor",
        "gyro": "Gyro",
        "accelerometer": "Accelerometer",
        "gps": "GPS",
        "imu": "InertialUnit",
        "bump": "TouchSensor",
        "eye": "Camera",
    }


def test_a_name_that_ros_refuses_gets_underscores(load):
    """MuJoCo allows any character in a name, and a user may be unable to rename elements of a model."""
    found = kinds(load(FORCE.replace('"push"', '"/cart::pushé"')))

    assert found["cart__push_"] == "LinearMotor"


def test_names_of_one_topic_are_refused_with_the_text_that_renames_one(load):
    """Both devices would have the same ROS topic, so a client could reach only one of them."""
    with pytest.raises(WorldError, match="devices 'cart position' and 'cart-position'") as refused:
        load(FORCE.replace('"push"', '"cart position"'), '<jointpos name="cart-position" joint="hinge"/>')

    assert '<text name="device:sensor/cart-position" data="..."/>' in str(refused.value)


def test_a_text_renames_a_device_or_leaves_it_out(load):
    """A user's program may expect other device names than those of the model."""
    texts = '<text name="device:actuator/push" data="motor"/><text name="device:camera/eye" data="-"/>'

    found = kinds(load(FORCE, "", ("<custom>", f"<custom>{texts}")))

    assert "motor" in found
    assert not {"push", "eye"} & found.keys()


def test_a_camera_shows_the_model_as_mujoco_draws_it(load):
    """The plate below the camera is red, and blue is the first color of a pixel.

    The camera moves with its body.
    """
    plate = '<geom type="box" pos="0 0 0.1" size="0.5 0.5 0.01" rgba="1 0 0 1" contype="0" conaffinity="0"/>'
    simulation = load(FORCE, "", ('<geom name="floor"', f'{plate}<geom name="floor"'))
    _, camera = simulation.robots[0].parts.devices.rows["eye"]
    camera.enabled(10)

    picture = np.frombuffer(camera.value, np.uint8).reshape(16, 32, 4)
    blue, green, red, alpha = picture[8, 16].tolist()

    assert red > 100 > max(blue, green)
    assert alpha == 255
    before = bytes(camera.value)
    simulation.robots[0].motors["push"].set_effort(10.0)
    simulation.step(500)
    assert bytes(camera.value) != before


def test_a_force_accelerates_its_joint(load):
    """The device accounts for the gear: 1.1 N accelerate 1.1 kg at 1 m/s2, for half a second."""
    simulation = load(FORCE, "", ('damping="0.01"', 'damping="1000"'))
    simulation.robots[0].motors["push"].set_effort(1.1)

    simulation.step(500)

    assert value(simulation, "cart speed") == pytest.approx(0.5, rel=0.01)
    assert value(simulation, "cart position") == pytest.approx(0.125, rel=0.02)


def test_a_servo_for_a_velocity_turns_at_it_and_to_a_target(load):
    """A motor of Webots turns to its target position.

    With an infinite target position it turns at its velocity.
    """
    simulation = load(VELOCITY)
    motor = simulation.robots[0].motors["push"]
    motor.set_position(math.inf)
    motor.set_velocity(0.5)
    simulation.step(1000)
    assert value(simulation, "cart speed") == pytest.approx(0.5, abs=0.02)

    motor.set_position(0.2)
    simulation.step(3000)

    assert value(simulation, "cart position") == pytest.approx(0.2, abs=0.02)


def test_a_servo_for_a_position_goes_there_at_the_commanded_velocity(load):
    """Without a commanded velocity the servo moves as fast as its force allows."""
    simulation = load(POSITION)
    motor = simulation.robots[0].motors["push"]
    motor.set_position(1.0)
    motor.set_velocity(0.5)
    simulation.step(1000)
    assert value(simulation, "cart position") == pytest.approx(0.5, abs=0.05)

    motor.set_velocity(100.0)
    simulation.step(3000)

    assert value(simulation, "cart position") == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("actuator", "command", "message"),
    [
        (
            FORCE,
            lambda motor: motor.set_position(1.0),
            "is controlled by force; set a force or torque, or write",
        ),
        (FORCE, lambda motor: motor.set_velocity(1.0), "is controlled by force; set a force or torque"),
        (
            POSITION,
            lambda motor: motor.set_effort(1.0),
            "is controlled by position; set a position or velocity",
        ),
        (
            VELOCITY,
            lambda motor: motor.set_available_torque(1.0),
            "only forcerange in the model can limit its force",
        ),
        (POSITION, lambda motor: motor.set_acceleration(1.0), "MuJoCo cannot limit its acceleration"),
    ],
)
def test_a_command_that_the_actuator_cannot_follow_fails(load, actuator, command, message):
    """If such a command succeeded without effect, a policy would learn with a robot that does not move."""
    motor = load(actuator).robots[0].motors["push"]

    with pytest.raises(UnsimulatedError, match=message):
        command(motor)


def test_sensors_have_the_values_of_the_moment(load):
    """MuJoCo computes sensor values at the beginning of a step. A device must have the values at its end."""
    simulation = load()
    simulation.robots[0].motors["push"].set_effort(5.0)

    simulation.step(200)

    data = simulation._model.data
    assert value(simulation, "cart position") == float(data.qpos[0])
    assert value(simulation, "cart speed") == float(data.qvel[0])


def test_a_rangefinder_measures_meters_and_its_whole_reach_if_it_meets_nothing(load):
    """If the ray hits no object, MuJoCo returns -1. A policy would take -1 for a very near object."""
    simulation = load(FORCE, '<rangefinder name="up" site="skin" cutoff="7"/>')

    simulation.step(10)

    assert value(simulation, "down") == pytest.approx(0.9)
    assert value(simulation, "up") == 7.0


def test_the_other_sensors_have_the_units_of_webots(load):
    """As in Webots, an accelerometer at rest measures gravity upward, and a quaternion ends with w.

    The chip with the sensors is upside down, so the value along its z axis is negative.
    """
    simulation = load()

    simulation.step(10)

    assert value(simulation, "imu") == pytest.approx((1.0, 0.0, 0.0, 0.0))
    assert value(simulation, "accelerometer")[2] == pytest.approx(-9.81, abs=0.1)
    assert value(simulation, "gps")[:2] == pytest.approx((1.0, 1.0))
    assert value(simulation, "bump") == 0.0

    simulation.step(1000)

    assert value(simulation, "bump") == pytest.approx(4.19 * 9.81, rel=0.2)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (
            (FORCE, "", ("<custom>", '<custom><text name="device:sensor/x" data="y"/>')),
            "the model has no sensor/x; write one of: sensor/accelerometer, ",
        ),
        ((FORCE.replace("slider", "slide"),), r"cartpole.xml:\d+:1: .*unknown transmission target 'slide'"),
        ((FORCE, "", ("<custom>", '<custom><text name="keyframe" data="home"/>')), "no keyframe 'home'"),
        ((FORCE, "", ("--synchronize", "")), "controllerArgs without --synchronize"),
    ],
)
def test_what_cannot_be_a_device_is_refused_before_anything_starts(load, texts, message):
    """The message names the element of the model, the fact and the remedy."""
    with pytest.raises(WorldError, match=message):
        load(*texts)


def test_devices_of_one_name_are_told_apart(load):
    """In MJCF a name is unique only within its section, and the velocity term of a servo may lack a name."""
    servo = '<position joint="slider" kp="20"/><velocity joint="slider" kv="1"/>'

    found = kinds(load(servo + FORCE, '<jointpos name="push" joint="hinge"/>'))

    assert {"slider_position", "slider_velocity", "push", "push_jointpos"} <= set(found)


def test_sensors_without_names_on_one_joint_have_their_numbers(load):
    """MuJoCo loads such sensors. A text in <custom> cannot rename them, because they have no names."""
    twice = '<jointvel joint="hinge"/><jointvel joint="hinge"/>'

    found = kinds(load(FORCE, twice))

    numbered = [name for name in found if name.startswith("hinge_jointvel")]
    assert len(numbered) == 2
    assert all(name.removeprefix("hinge_jointvel").isdigit() for name in numbered)


def test_refused_sensors_do_not_search_the_file_once_each(load, monkeypatch):
    """With 60,000 sensors of one name, the refusal took more than a minute."""
    searched = []
    walk = Element.walk
    monkeypatch.setattr(Element, "walk", lambda element: searched.append(element) or walk(element))

    load(FORCE, '<jointvel name="a b" joint="hinge"/>')
    few = len(searched)
    searched.clear()
    with pytest.raises(WorldError):
        load(FORCE, "".join(f'<jointvel name="a{mark}b" joint="hinge"/>' for mark in " -./()"))

    assert len(searched) <= few + 10


def test_a_part_of_the_model_that_leads_outside_is_refused(load, tmp_path):
    """An included file may refer to files outside of the folder of the model."""
    (tmp_path / "part.xml").write_text('<mujoco><asset><mesh file="/etc/x.obj"/></asset></mujoco>')

    with pytest.raises(WorldError, match=r"part\.xml:1:16: '/etc/x.obj' is not relative to the folder"):
        load(FORCE, "", ("<worldbody>", '<include file="part.xml"/><worldbody>'))


def test_a_part_of_the_model_that_is_missing_is_refused(load):
    """MuJoCo's own error does not show in which folder it searched."""
    with pytest.raises(WorldError, match=r"the file 'part\.xml', which is part of the model, is missing"):
        load(FORCE, "", ("<worldbody>", '<include file="part.xml"/><worldbody>'))
