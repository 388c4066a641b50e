"""Many copies of a world in one process: each copy has the bits of the single simulation."""

import json
import math

import numpy as np
import pytest

from palaestra_protocol.batch import BatchRequest
from palaestra_sim.mujoco.batched.model_batch import ModelBatch
from palaestra_sim.mujoco.batched.scene_batch import SceneBatch
from palaestra_sim.mujoco.batched.world import BatchRefusedError, Reset
from palaestra_sim.mujoco.cli import main
from palaestra_sim.mujoco.mjcf.loader import load as load_model
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.geometry import axis_angle_to_quaternion, to_quaternion
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.scene.tree.fields import quaternion_to_axis_angle
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin, builtin_path

PERIOD_MS = 192
ARENA = builtin_path("arena")
CARTPOLE = """<mujoco>
  <custom>
    <text name="controllerArgs" data="--name=cartpole --synchronize"/>
    <numeric name="basicTimeStep" data="20"/>
  </custom>
  <option timestep="0.005"/>
  <worldbody>
    <body name="cart" pos="0 0 1">
      <joint name="slider" type="slide" axis="1 0 0" range="-1.8 1.8" limited="true"/>
      <geom type="box" size="0.1 0.08 0.05" mass="1"/>
      <body name="pole">
        <joint name="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.03" mass="0.1" contype="0" conaffinity="0"/>
        <site name="tip"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <adhesion name="grip" body="cart" ctrlrange="0 1"/>
    <motor name="push" joint="slider" gear="2" {limits}/>
  </actuator>
  <sensor>
    <jointpos name="cart position" joint="slider"/>
    <jointvel name="cart speed" joint="slider"/>
    <jointpos name="hinge" joint="hinge"/>
    <gyro name="gyro" site="tip"/>
  </sensor>
</mujoco>
"""
WHEELS = ("wheel0_joint", "wheel1_joint", "wheel2_joint")
SENSORS = (*(f"ir{number}" for number in range(1, 10)), "touch sensor", "wheel0_joint_sensor")
ROBOTINO = BatchRequest(
    period_ms=PERIOD_MS, motors=WHEELS, commanded="velocity", sensors=SENSORS, robot="ROBOTINO", mark="TARGET"
)
CART = BatchRequest(
    period_ms=40,
    motors=("push",),
    commanded="force",
    sensors=("cart position", "cart speed", "hinge"),
    joints=("hinge",),
)
STARTS = ((1.3, 1.3, 0.4), (-1.3, 1.2, -2.0), (0.0, -1.4, 3.0))  # near walls, so that the robots touch them
STEPS = 30


def arena(rows, threads=2, path=ARENA):
    """Return copies of the arena, before `open`."""
    load = Loader(physics=lambda: MujocoPhysics(feeling=True))
    return SceneBatch(load(path, Mode.FAST), "arena.wbt", rows, threads)


def carts(tmp_path, rows, *, limited=True, threads=2):
    """Return copies of a cart-pole, before `open`; without limits, a force can be as large as a float."""
    limits = 'ctrlrange="-10 10" ctrllimited="true"' if limited else ""
    path = tmp_path / "cartpole.xml"
    path.write_text(CARTPOLE.format(limits=limits))
    return ModelBatch(load_model(path, Mode.FAST), path.name, rows, threads)


def at_the_starts(rows=(0, 1, 2)):
    """Return a reset of robots at `STARTS`, each with a seed of its own."""
    turns = [axis_angle_to_quaternion((0.0, 0.0, 1.0, STARTS[row][2])) for row in rows]
    return Reset(
        rows=np.array(rows),
        seeds=np.array(rows) + 7,
        places=np.array([(*STARTS[row][:2], *turn) for row, turn in zip(rows, turns, strict=True)]),
        joints=np.zeros((len(rows), 0)),
        commands=np.zeros((len(rows), 3)),
    )


def upright(rows):
    """Return a reset of cart-poles with slightly different angles."""
    return Reset(
        rows=np.array(rows),
        seeds=np.array(rows),
        places=np.zeros(0),
        joints=0.01 * np.array(rows, float)[:, None],
        commands=np.zeros((len(rows), 1)),
    )


def commands_of(rows, motors, seed=3):
    """Return commands that change every fourth step: (steps, rows, motors)."""
    random = np.random.default_rng(seed)
    return np.repeat(random.uniform(-9.0, 9.0, (STEPS // 4 + 1, rows, motors)), 4, axis=0)[:STEPS]


def played(batch, reset, commands):
    """Return values and poses after a reset and after each step: (1 + steps, rows, numbers)."""
    readings = [batch.reset(reset), *(batch.step(each) for each in commands)]
    return np.array([np.column_stack([each.values, each.poses]) for each in readings])


def single(row, commands, path=ARENA):
    """Return the readings of a client of the single simulation in the same episode."""
    simulation = Loader(physics=MujocoPhysics)(path, Mode.FAST)
    robot = simulation.robots[0]
    robot.custom_data = json.dumps({"seed": row + 7})
    simulation.reset()
    simulation.step(PERIOD_MS)
    for motor in robot.motors.values():
        motor.set_position(math.inf)
        motor.set_velocity(0.0)
    x, y, heading = STARTS[row]
    turn = quaternion_to_axis_angle(*axis_angle_to_quaternion((0.0, 0.0, 1.0, heading)))
    height = robot.place.translation[2]
    for name, type_, value in (
        ("translation", FieldType.VEC3F, (x, y, height)),
        ("rotation", FieldType.ROTATION, turn),
    ):
        simulation.tree.field_of(robot.parts.node, name, simulation).set(type_, 0, value)
    simulation.step(PERIOD_MS)
    seen = [look(robot)]
    for command in commands:
        for wheel, velocity in zip(WHEELS, command.tolist(), strict=True):
            robot.motors[wheel].set_velocity(velocity)
        simulation.step(PERIOD_MS)
        seen.append(look(robot))
    return np.array(seen)


def look(robot):
    """Return the readings of the sensors, and the pose as a client computes it from a quaternion."""
    x, y, _ = robot.place.world_position
    _, _, z, w = to_quaternion(robot.place.world_pose.rotation)
    heading = math.remainder(2.0 * math.atan2(z, w), 2.0 * math.pi)
    return [*(float(robot.sensors[name].value) for name in SENSORS), x, y, heading]


@pytest.mark.parametrize("wheel", [b"", b" position 3.2"])
def test_each_robot_has_the_bits_of_the_single_simulation(tmp_path, wheel) -> None:
    """A policy is trained in the copies and evaluated in the single simulation, so they must be one world.

    In a world that was saved while it ran, the wheels have angles.
    """
    path = tmp_path / "arena.wbt"
    path.write_bytes(builtin("arena").replace(b"axis -1 0 0", b"axis -1 0 0" + wheel))
    commands = commands_of(3, 3)
    batch = arena(3, path=path)
    batch.open(ROBOTINO)

    found = played(batch, at_the_starts(), commands)

    for row in range(3):
        assert np.array_equal(found[:, row], single(row, commands[:, row], path))
    assert found[:, :, SENSORS.index("touch sensor")].any()


@pytest.mark.parametrize("threads", [1, 3])
def test_the_number_of_threads_does_not_change_a_bit(threads) -> None:
    """A run that resumes on a machine with more processors must continue as it would have continued."""
    commands = commands_of(3, 3)
    one, other = arena(3), arena(3, threads)
    one.open(ROBOTINO)
    other.open(ROBOTINO)

    assert np.array_equal(played(one, at_the_starts(), commands), played(other, at_the_starts(), commands))


def test_an_episode_does_not_depend_on_the_copy_or_on_earlier_episodes() -> None:
    """A resumed run plays an episode again from its reset, while the other copies may be in any state."""
    commands = commands_of(3, 3)
    batch = arena(3)
    batch.open(ROBOTINO)
    first = played(batch, at_the_starts(), commands)
    batch.step(np.full((3, 3), 9.0))
    batch.reset(at_the_starts((1,)))

    again = [batch.step(each) for each in commands]

    assert np.array_equal([each.values[1] for each in again], first[1:, 1, :-3])


def test_a_copy_that_fails_leaves_the_others_as_they_are(tmp_path) -> None:
    """An unstable simulation of one copy must cost one episode, not 256."""
    commands = commands_of(3, 1)
    whole, broken = carts(tmp_path, 3, limited=False), carts(tmp_path, 3, limited=False)
    whole.open(CART)
    broken.open(CART)
    expected = played(whole, upright((0, 1, 2)), commands)
    broken.reset(upright((0, 1, 2)))
    wild = commands.copy()
    wild[:, 1] = 1e300

    found = [broken.step(each) for each in wild]

    assert [each.failed.tolist() for each in found[-2:]] == [[False, True, False]] * 2
    assert set(found[-1].reasons) == {1}
    for row in (0, 2):
        assert np.array_equal([each.values[row] for each in found], expected[1:, row, :3])


def test_a_reset_makes_a_failed_copy_whole_again(tmp_path) -> None:
    """The failure must have no effect on the next episode of the copy."""
    batch = carts(tmp_path, 2, limited=False)
    batch.open(CART)
    expected = batch.reset(upright((0, 1)))
    for _ in range(STEPS):
        batch.step(np.array([[0.0], [1e300]]))

    again = batch.reset(upright((1,)))

    assert not again.failed.any()
    assert np.array_equal(again.values[0], expected.values[1])


def test_each_cart_has_the_bits_of_the_single_model(tmp_path) -> None:
    """A model of MuJoCo is stepped together too, with its own motors and sensors."""
    commands = commands_of(2, 1)
    batch = carts(tmp_path, 2)
    batch.open(CART)

    found = played(batch, upright((0, 1)), commands)

    for row in range(2):
        simulation = load_model(tmp_path / "cartpole.xml", Mode.FAST)
        robot = simulation.robots[0]
        simulation.reset()
        simulation.step(CART.period_ms)
        simulation.set_joint_position(simulation.tree.of_def("hinge"), 0.01 * row, 1)
        seen = []
        for force in (0.0, *commands[:, row, 0].tolist()):
            robot.motors["push"].set_effort(force)
            simulation.step(CART.period_ms)
            seen.append([robot.sensors[name].value for name in CART.sensors])
        assert np.array_equal(found[:, row, :3], seen)


def test_the_parts_that_a_batch_does_not_simulate_are_listed_in_one_message() -> None:
    """Without the message, a missing camera image or different noise would change the policy unnoticed."""
    load = Loader(physics=lambda: MujocoPhysics(feeling=True))

    with pytest.raises(
        BatchRefusedError, match=r"Camera 'camera'; .*RangeFinder 'depth camera'; .*remove batch"
    ):
        SceneBatch(load(builtin_path("seeing"), Mode.FAST), "seeing.wbt", 2, 1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--check"], "does not simulate the Camera 'camera'"),
        ([], "does not simulate the Camera 'camera'"),
        (["--fault", "crash:step=9"], "--batch: injects no faults; remove --fault"),
    ],
)
def test_the_program_refuses_with_the_exit_code_of_a_wrong_world(options, message, capsys) -> None:
    """A sidecar reports the last line, and the trainer does not start such a simulator again and again."""
    code = main([str(builtin_path("seeing")), "--batch", "4", *options])

    assert code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"period_ms": 100}, "100 ms is not a multiple of the basic step of 32 ms"),
        ({"motors": ("leg",)}, "the robot has no motor 'leg'"),
        ({"sensors": ("nose",)}, "the robot has no sensor 'nose'"),
        ({"commanded": "force"}, "commands wheels by velocity, not by force"),
        ({"robot": "EPUCK"}, "the world has no robot DEF EPUCK"),
        ({"mark": "WALL_0"}, "cannot move WALL_0, because it has a boundingObject"),
        ({"joints": ("hinge",)}, "does not set joints, such as 'hinge'"),
        ({"mark": "NOWHERE"}, "the world has no node DEF NOWHERE"),
    ],
)
def test_a_request_that_does_not_fit_the_world_is_refused(changes, fact) -> None:
    """Before the first step, the trainer then reports that the world does not fit the job's robot."""
    content = {**ROBOTINO.to_json(), **{name: value if isinstance(value, str | int) else list(value)
                                        for name, value in changes.items()}}  # fmt: skip
    batch = arena(2)

    with pytest.raises(BatchRefusedError, match=fact):
        batch.open(BatchRequest.from_json(content))


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"commanded": "velocity"}, "the motor 'push' is commanded by force, not by velocity"),
        ({"sensors": ["gyro"]}, "does not read 'gyro'"),
        ({"sensors": ["push"]}, "the model has no sensor 'push'"),
        ({"sensors": ["mujoco/grip"]}, "the model has no sensor 'mujoco/grip'"),
        ({"motors": ["leg"]}, "the motor 'leg' does not exist"),
        ({"motors": ["hinge"]}, "the motor 'hinge' does not exist"),
        ({"period_ms": 30}, "30 ms is not a multiple of the basic step of 20 ms"),
        ({"sensors": ["nose"]}, "the model has no sensor 'nose'"),
        ({"joints": ["knee"]}, "the model has no hinge or slider 'knee'"),
        ({"robot": "CART"}, "does not place CART in a model of MuJoCo"),
    ],
)
def test_a_request_that_does_not_fit_the_model_is_refused(changes, fact, tmp_path) -> None:
    """A model gets the same refusals as a world with wheels, in the test above."""
    batch = carts(tmp_path, 2)

    with pytest.raises(BatchRefusedError, match=fact):
        batch.open(BatchRequest.from_json({**CART.to_json(), **changes}))


DOOR = """Solid { translation 0 0 3 name "frame" children [ HingeJoint {
  jointParameters HingeJointParameters { axis 0 0 1 }
  endPoint Solid { name "door" boundingObject Box { size 0.1 0.4 0.4 } physics Physics { density -1 mass 3 } }
} ] }"""


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        (
            ("", "Solid { translation 0 0 3 boundingObject Box { } physics Physics { } }"),
            "1 Solids with physics",
        ),
        (("", DOOR), "1 doors"),
        (("", 'Robot { name "other" translation 0 0 3 }'), "simulates one robot, and the world has 2"),
        (('coordinateSystem "ENU"', 'coordinateSystem "NUE"'), "a world whose y axis points up"),
        (("supervisor TRUE", "supervisor TRUE battery [ 50 60 10 ]"), "does not simulate a battery"),
    ],
)
def test_a_world_whose_parts_no_copy_would_have_is_refused(change, fact) -> None:
    """If a copy left the door out, a policy would learn to drive through a wall."""
    old, new = change
    text = builtin("arena").decode()
    text = text.replace(old, new, 1) if old else f"{text}\n{new}\n"
    simulation = Simulation.load(text.encode(), MujocoPhysics(feeling=True), "world.wbt", Mode.FAST)

    with pytest.raises(BatchRefusedError, match=f"{fact}.*remove batch from the job"):
        SceneBatch(simulation, "world.wbt", 2, 1)


def test_a_world_without_mujoco_is_refused() -> None:
    """The stub's robots have no MuJoCo body that could be copied."""
    simulation = Simulation.load(builtin("arena"), StubPhysics(), "world.wbt", Mode.FAST)

    with pytest.raises(BatchRefusedError, match="simulates robots that drive on wheels with fixed axles"):
        SceneBatch(simulation, "world.wbt", 2, 1)
