"""MuJoCo's sensors and actuators for which Webots has no device type."""

import logging
import math

import numpy as np
import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.cli import main
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.loader import load as load_mjcf
from palaestra_sim.ros_controller.simulator import RunningSimulator
from palaestra_sim.scene.mode import Mode
from palaestra_trainer.webots import MujocoSensor
from tests.unit.mjcf.conftest import FORCE
from tests.unit.stub.conftest import FakeRos

VELOCITY = '<framelinvel name="cart velocity" objtype="body" objname="pole"/>'
SENSORS = f"""{VELOCITY}
<force name="f" site="chip"/> <torque name="t" site="chip"/> <velocimeter name="v" site="chip"/>
<magnetometer name="m" site="chip"/> <subtreecom name="c" body="cart"/> <user name="u" dim="5"/>
<frameangacc name="a" objtype="body" objname="pole"/> <framexaxis objtype="body" objname="pole"/>"""
NAMES = ["cart velocity", "f", "t", "v", "m", "c", "u", "a", "pole_framexaxis"]
GRIP = '<adhesion name="grip" body="cart" ctrlrange="0 1" gain="5"/>'
MUSCLE = '<muscle name="arm" joint="hinge" ctrlrange="0 1" lengthrange="0 1"/>'
GENERAL = '<general name="any" joint="hinge" dyntype="integrator"/>'
DRIVE = """<dcmotor name="drive" joint="hinge" motorconst="1" resistance="1" input="pos vel"
  controller="10 0 5"/>"""
SPIN = '<dcmotor name="spin" joint="hinge" motorconst="1" resistance="1"/>'
FACE = '<orientation name="face" site="skin" refsite="chip" input="quat" kp="1" dampratio="1"/>'


def device(simulation, name):
    """Return a device of the robot by its name."""
    return simulation.robots[0].parts.devices.rows[name][1]


@pytest.fixture
def ros():
    """Return a fake ROS without nodes."""
    return FakeRos()


@pytest.fixture
def robot(ros, cartpole):
    """`robot(actuator, sensor)` starts a world and returns the node of its robot."""

    def start(*texts):
        RunningSimulator(cartpole(*texts), load_mjcf, ros.make_node, mode=Mode.FAST, clock=ros.clock).start()
        return ros.node("cartpole")

    return start


def test_a_sensor_of_several_numbers_has_those_of_mujoco(load, cartpole):
    """In three poses, MuJoCo itself computes the same values for the same state."""
    simulation = load(FORCE, SENSORS)
    model = mujoco.MjModel.from_xml_path(str(cartpole(FORCE, SENSORS)))
    data = mujoco.MjData(model)

    for angle_rad, effort_n in ((0.1, 2.0), (1.0, -5.0), (-2.0, 0.0)):
        simulation.set_joint_position(simulation.tree.of_def("hinge"), angle_rad, 1)
        simulation.robots[0].motors["push"].set_effort(effort_n)
        simulation.step(50)
        inner = simulation._model.data
        data.qpos[:], data.qvel[:], data.ctrl[:] = inner.qpos, inner.qvel, inner.ctrl
        data.qacc_warmstart[:] = inner.qacc_warmstart
        mujoco.mj_forward(model, data)
        for name in NAMES:
            number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name)
            number = model.nsensor - 1 if number < 0 else number  # -1: the sensor without a name
            start = model.sensor_adr[number]
            expected = data.sensordata[start : start + model.sensor_dim[number]]
            value = simulation.robots[0].sensors[f"mujoco/{name}"].value
            assert value == tuple(expected.tolist()), name


def test_a_sensor_of_one_number_stays_a_position_sensor(load):
    """The message of a Webots position sensor has space for one number."""
    simulation = load(FORCE, '<user name="one" dim="1"/>')

    assert "one" in simulation.robots[0].sensors


def test_its_messages_have_the_numbers_once_it_is_enabled(robot):
    """The trainer's sensor class reads these messages."""
    node = robot(FORCE, VELOCITY)
    messages = node.inbox("mujoco/cart_velocity/value")
    node.call("robot/time_step", value=10)
    assert messages == []

    assert node.get("mujoco/cart_velocity/enable", value=20) is True
    assert node.get("mujoco/cart_velocity/get_sampling_period") == 20
    for _ in range(4):
        node.call("robot/time_step", value=20)

    (publisher,) = node.publishers("mujoco/cart_velocity/value")
    assert publisher.type_name == "std_msgs/Float64MultiArray"
    assert len(messages) == 4
    assert messages[-1]["layout"]["dim"] == [{"label": "framelinvel", "size": 3, "stride": 3}]
    assert len(messages[-1]["data"]) == 3


def test_services_name_it_below_mujoco(robot):
    """A client builds the paths of a device's services from the name in the list of devices."""
    node = robot(FORCE, VELOCITY)

    assert "mujoco/cart velocity" in node.get("robot/get_device_list")
    assert node.get("mujoco/cart_velocity/get_name") == "mujoco/cart velocity"
    assert MujocoSensor("cartpole", "cart velocity").device == "mujoco/cart velocity"


def test_a_reset_returns_its_numbers_and_the_control(load):
    """After a reset an actuator has no command, as at the start."""
    simulation = load(FORCE + GRIP, VELOCITY)
    simulation.robots[0].motors["push"].set_effort(5.0)
    simulation.step(10)
    first = simulation.robots[0].sensors["mujoco/cart velocity"].value
    device(simulation, "mujoco/grip").set_control(1.0)
    simulation.step(100)
    simulation.reset()
    simulation.step(10)

    assert device(simulation, "mujoco/grip").control == 0.0
    simulation.robots[0].motors["push"].set_effort(5.0)
    simulation.step(10)
    assert simulation.robots[0].sensors["mujoco/cart velocity"].value == first


@pytest.mark.parametrize(
    ("actuator", "name"), [(GRIP, "grip"), (MUSCLE, "arm"), (GENERAL, "any")], ids=["grip", "arm", "any"]
)
def test_an_actuator_without_a_motor_takes_mujocos_control(robot, actuator, name):
    """Such actuators are a muscle, an adhesion, and an actuator that integrates its control."""
    node = robot(FORCE + actuator)
    path = f"mujoco/{name}"
    assert node.get(f"{path}/get_control") == 0.0

    assert node.get(f"{path}/set_control", value=0.5) is True
    node.call("robot/time_step", value=10)

    assert node.get(f"{path}/get_control") == 0.5


def test_an_adhesion_keeps_its_control_within_its_range(load):
    """MuJoCo limits the control too. NaN is refused, because a client must not make the simulation fail."""
    simulation = load(FORCE + GRIP)
    grip = device(simulation, "mujoco/grip")

    assert grip.set_control(7.0)
    assert not grip.set_control(math.nan)
    simulation.step(10)

    assert (grip.low, grip.high, grip.control) == (0.0, 1.0, 1.0)
    assert simulation._model.data.ctrl.tolist() == [0.0, 1.0]


def test_each_control_of_an_actuator_is_a_device_of_its_own(load, cartpole):
    """MuJoCo counts controls, so the control of a later actuator has another number than the actuator."""
    world = (DRIVE + FACE + FORCE,)
    simulation = load(*world)
    robot = simulation.robots[0]
    model = mujoco.MjModel.from_xml_path(str(cartpole(*world)))
    data = mujoco.MjData(model)

    device(simulation, "mujoco/drive_vel").set_control(2.0)
    device(simulation, "mujoco/face_qx").set_control(0.5)
    robot.motors["push"].set_effort(5.0)
    simulation.step(100)
    data.ctrl[:] = [0.0, 2.0, 1.0, 0.5, 0.0, 0.0, 2.5]  # "push" has a gear of 2
    mujoco.mj_step(model, data, nstep=50)

    inner = simulation._model.data
    assert inner.ctrl.tolist() == data.ctrl.tolist()
    assert inner.qpos.tolist() == data.qpos.tolist()
    assert robot.motors["push"].feedback_nm == pytest.approx(5.0)
    assert {f"mujoco/face_q{part}" for part in "wxyz"} < set(robot.parts.devices.rows)


def test_a_force_about_an_axis_of_a_ball_joint_is_a_motor(load):
    """The gear of such an actuator is a vector, whose first number may be 0."""
    turn = '<motor name="turn" joint="swivel" gear="0 2 0"/>'
    ball = '<body pos="0 0 3"><joint name="swivel" type="ball"/><geom size="0.1" mass="1"/></body>'
    simulation = load(turn, "", ("</worldbody>", f"{ball}</worldbody>"))
    motor = simulation.robots[0].motors["turn"]

    motor.set_effort(5.0)
    simulation.step(10)

    assert motor.control[1] == 0.5
    assert motor.feedback_nm == pytest.approx(5.0)
    assert simulation._model.data.ctrl.tolist() == [2.5]


def test_a_model_whose_only_actuator_has_no_control_is_refused(load):
    """A trainer could not move anything in such a world."""
    with pytest.raises(WorldError, match="the model has no actuator"):
        load(SPIN.replace("/>", ' input="none"/>'))


def test_the_body_of_an_orientation_servo_is_the_robot(load):
    """The first actuator decides which body of the top level is the robot."""
    assert load(FACE).robots[0].parts.place.translation == (1.0, 1.0, 0.5)


def test_an_adhesion_pulls(load):
    """The ball is pulled to the floor, so its touch sensor measures more than its weight."""
    pull = '<adhesion name="pull" body="ball" ctrlrange="0 1" gain="100"/>'
    simulation = load(FORCE + pull)
    simulation.step(2000)
    weight_n = simulation.robots[0].sensors["bump"].value
    device(simulation, "mujoco/pull").set_control(1.0)

    simulation.step(1000)

    assert simulation.robots[0].sensors["bump"].value == pytest.approx(weight_n + 100.0, rel=0.05)


@pytest.mark.parametrize(
    ("texts", "type_name", "name"),
    [
        ((FORCE, VELOCITY), "framelinvel", "mujoco/cart velocity"),
        ((FORCE + GRIP,), "adhesion", "mujoco/grip"),
        ((FORCE + MUSCLE,), "muscle", "mujoco/arm"),
        ((FORCE + GENERAL,), "general", "mujoco/any"),
        ((FORCE + SPIN,), "dcmotor", "mujoco/spin"),
    ],
    ids=["sensor", "adhesion", "muscle", "general", "dcmotor"],
)
def test_leave_out_leaves_out_a_type(load, texts, type_name, name):
    """The trainer logs the devices that are left out, and the job's status lists them."""
    simulation = load(*texts, leave_out=[type_name])

    assert name not in simulation.robots[0].parts.devices.rows
    (left_out,) = simulation.left_out
    assert left_out.fact.endswith(f"{name!r} of type {type_name} has no device in Webots")


def test_a_text_renames_it_or_leaves_it_out(load):
    """The new name of a renamed device also begins with `mujoco/`."""
    texts = '<text name="device:sensor/cart velocity" data="v"/><text name="device:actuator/grip" data="-"/>'

    rows = load(FORCE + GRIP, VELOCITY, ("<custom>", f"<custom>{texts}")).robots[0].parts.devices.rows

    assert "mujoco/v" in rows
    assert not [name for name in rows if "grip" in name]


def test_a_sensor_and_an_actuator_of_one_name_are_told_apart(load):
    """In MJCF a name is unique only within its section."""
    rows = load(FORCE + GRIP, VELOCITY.replace("cart velocity", "grip")).robots[0].parts.devices.rows

    assert {"mujoco/grip", "mujoco/grip_framelinvel"} <= set(rows)


def test_two_of_one_name_are_refused_with_the_text_that_renames_one(load):
    """The remedy uses the sensor's name in the model, so that the user can find the sensor there."""
    texts = '<text name="device:sensor/cart velocity" data="grip"/>'

    with pytest.raises(WorldError, match="a second device 'mujoco/grip'"):
        load(FORCE + GRIP, VELOCITY, ("<custom>", f"<custom>{texts}"))


def test_the_check_counts_and_names_them(cartpole, capsys, caplog):
    """A program that was written for Webots does not know these devices."""
    caplog.set_level(logging.WARNING)

    assert main([str(cartpole(FORCE + GRIP, SENSORS)), "--check"]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert "differs from Webots: 1 MujocoActuator, a type that Webots does not have: mujoco/grip" in lines
    (sensors,) = [line for line in lines if "9 MujocoSensor, a" in line]
    assert sensors.endswith("mujoco/a, ...")


def test_a_number_that_is_not_finite_reaches_the_sensor(load):
    """The trainer must see the NaN, which it treats as a fault of the simulator."""
    simulation = load(FORCE, VELOCITY)
    simulation._model.data.qvel[0] = math.nan
    simulation._model.changed()
    simulation.sample()

    assert np.isnan(simulation.robots[0].sensors["mujoco/cart velocity"].value).any()
