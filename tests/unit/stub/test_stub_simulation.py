"""The simulation without ROS, for a program that uses it directly, and the effects of a reset."""

import math
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.scene.robot import seed_of
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.world import builtin
from tests.robotino import WHEELS, wheel_speeds
from tests.scenes import load_scene


@pytest.fixture
def simulation():
    """Return the simulation of the built-in arena."""
    return load_scene(builtin("arena"))


def drive(simulation, vx, vy, omega):
    """Command the wheels of the first robot for a velocity."""
    motors = simulation.robots[0].motors
    for name, speed in zip(WHEELS, wheel_speeds(vx, vy, omega), strict=True):
        motors[name].set_position(math.inf)
        motors[name].set_velocity(speed)


def readings(simulation):
    """Return the values of all sensors and the pose of the robot, unrounded."""
    robot = simulation.robots[0]
    return [sensor.value for sensor in robot.sensors.values()] + [*robot.place.translation]


def run(simulation, steps=30):
    """Drive a fixed route, and return the readings after each step."""
    history = []
    for step in range(steps):
        drive(simulation, 0.3, 0.1 * math.sin(step), 0.2)
        simulation.step(192)
        history.append(readings(simulation))
    return history


def test_it_can_be_driven_without_ros(simulation):
    """A test needs no ROS to load a world, command motors, step, and read sensors."""
    robot = simulation.robots[0]
    robot.motors["wheel0_joint"].set_position(math.inf)
    robot.motors["wheel0_joint"].set_velocity(2.0)

    simulation.step(192)

    assert simulation.time_ms == 192
    assert robot.sensors["wheel0_joint_sensor"].value == pytest.approx(2.0 * 0.192)
    assert robot.sensors["ir1"].value == pytest.approx(0.31, rel=0.05)


@given(
    ways=st.lists(
        st.tuples(
            st.sampled_from([(0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)]),
            st.integers(1, 3),
        ),
        max_size=8,
    )
)
def test_sending_a_velocity_again_changes_nothing(ways):
    """The trainer's facade sends only velocities that have changed; the run must be the same, bit for bit."""

    def moments(told_again):
        simulation = load_scene(builtin("arena"))
        motors = simulation.robots[0].motors
        told = dict.fromkeys(WHEELS, 0.0)
        drive(simulation, 0.0, 0.0, 0.0)
        for way, steps in ways:
            for _ in range(steps):
                for name, speed in zip(WHEELS, wheel_speeds(*way), strict=True):
                    if told_again or speed != told[name]:
                        motors[name].set_velocity(speed)
                        told[name] = speed
                simulation.step(192)
                yield readings(simulation)

    assert list(moments(told_again=True)) == list(moments(told_again=False))


def test_the_front_sensor_tells_volts_at_a_wall(simulation):
    """At the wall the ray is 2 mm long, so the first row of the table applies."""
    drive(simulation, 0.5, 0.0, 0.0)
    for _ in range(30):
        simulation.step(192)

    robot = simulation.robots[0]

    assert robot.place.translation[0] == pytest.approx(2.0 - 0.2286)
    assert robot.sensors["ir1"].value == pytest.approx(3.03, rel=0.03)
    assert robot.sensors["ir5"].value == pytest.approx(0.31, rel=0.03)


def test_the_bumper_tells_every_touch_since_it_was_read(simulation):
    """A touch in any basic step of a long step must be reported, and only once."""
    robot = simulation.robots[0]
    robot.body.place(1.76, 0.0, 0.0)
    drive(simulation, 0.5, 0.0, 0.0)
    simulation.step(64)
    assert robot.sensors["touch sensor"].value is True

    drive(simulation, -0.5, 0.0, 0.0)
    simulation.step(32)
    simulation.step(192)

    assert robot.sensors["touch sensor"].value is False


@pytest.mark.parametrize("duration_ms", [0, -32, 33])
def test_only_multiples_of_the_basic_step_can_be_stepped(simulation, duration_ms):
    """Another duration would be rounded to a duration that nobody requested."""
    with pytest.raises(ValueError, match="not a positive multiple of the basic step"):
        simulation.step(duration_ms)


def test_two_simulations_of_a_world_agree_bit_by_bit():
    """A person can reproduce a run only if the same world, commands and seed give the same results."""
    assert run(load_scene(builtin("arena"))) == run(load_scene(builtin("arena")))


def test_a_reset_repeats_the_run_bit_by_bit(simulation):
    """With the same seed in `customData`, an episode can be repeated exactly."""
    simulation.robots[0].custom_data = "7"
    simulation.reset()
    simulation.step(32)
    first = run(simulation)

    simulation.reset()
    simulation.step(32)

    assert run(simulation) == first


def test_another_seed_is_another_noise(simulation):
    """The noise affects only the readings, so the robot takes the same route."""
    histories = []
    for seed in ("7", '{"seed": 8}'):
        simulation.robots[0].custom_data = seed
        simulation.reset()
        simulation.step(32)
        histories.append(run(simulation))

    assert histories[0][-1][-3:] == histories[1][-1][-3:]
    assert histories[0] != histories[1]


def test_noise_does_not_depend_on_what_the_rays_meet(simulation):
    """Each sensor draws one number per step, so another route does not shift the noise of later steps."""
    values = []
    for x in (0.0, 1.7):
        simulation.reset()
        simulation.step(32)
        simulation.robots[0].body.place(x, 0.0, 0.0)
        simulation.step(192)
        values.append(simulation.robots[0].sensors["ir5"].value)

    assert values[0] == values[1]


def test_every_robot_has_noise_of_its_own():
    """With common noise, equal robots would measure with the same errors; `customData` seeds each robot."""
    source = builtin("arena")
    robot = source[source.index(b"DEF ROBOTINO Robot") :]
    source += robot.replace(b'name "robotino"', b'name "second" translation 0 1 0 customData "5"', 1)

    simulation = load_scene(source)
    simulation.step(32)

    assert [it.seed for it in simulation.robots] == [0, 5]
    assert simulation.robots[0].sensors["ir1"].value != simulation.robots[1].sensors["ir1"].value


@pytest.mark.parametrize(
    ("custom_data", "seed"),
    [
        ("7", 7),
        (" 12 ", 12),
        ('{"seed": 9}', 9),
        ('{"seed": 9, "episode": 3}', 9),
        ("", 1),
        ("seven", 1),
        ("1.5", 1),
        ("true", 1),
        ('{"seed": "9"}', 1),
        ('{"episode": 3}', 1),
        ("[7]", 1),
        ("[" * 100_000, 1),
    ],
)
def test_a_seed_is_a_number_or_in_an_object(custom_data, seed):
    """With any other value the seed stays as it was."""
    assert seed_of(custom_data, otherwise=1) == seed


@given(text=st.text())
def test_no_custom_data_is_an_error(text):
    """The data may belong to another program, so any text is accepted."""
    assert isinstance(seed_of(text, otherwise=1), int)


def test_the_first_seed_is_that_of_the_world(world):
    """The seed is WorldInfo.randomSeed until `customData` sets another seed."""
    assert load_scene(world(info="randomSeed 42")).robots[0].seed == 42


def test_a_reset_happens_within_the_next_basic_step(simulation):
    """The request alone changes nothing; after the next step, the time is one basic step."""
    drive(simulation, 0.3, 0.0, 0.0)
    simulation.step(1920)
    simulation.reset()
    assert simulation.time_ms == 1920

    simulation.step(32)

    assert simulation.time_ms == 32
    assert simulation.robots[0].place.translation == (0.0, 0.0, 0.0)


def test_the_steps_after_the_first_go_on_from_the_reset(simulation):
    """A long step with a reset in its first basic step continues for the other five."""
    simulation.reset()

    simulation.step(192)

    assert simulation.time_ms == 192


def test_a_reset_restores_motors_and_rest(simulation):
    """After a reset the motors hold position 0, so a client must send `set_position(inf)` again."""
    drive(simulation, 0.3, 0.0, 0.5)
    simulation.step(1920)
    simulation.reset()
    simulation.step(32)

    simulation.step(1920)
    robot = simulation.robots[0]

    assert robot.motors["wheel1_joint"].target_rad == 0.0
    assert robot.motors["wheel1_joint"].velocity_rad_s == pytest.approx(137.46)
    assert robot.place.translation == (0.0, 0.0, 0.0)


def test_a_reset_restores_the_places_of_all_solids(simulation):
    """A reset also restores the target and the cylinders, and the rays meet them there."""
    cylinder = simulation.tree.of_def("CYLINDER_0")
    translation = simulation.tree.field_of(cylinder, "translation", simulation)
    translation.set(FieldType.VEC3F, 0, (0.5, 0.0, 0.2))
    simulation.step(32)
    assert simulation.robots[0].sensors["ir1"].value > 1.0

    simulation.reset()
    simulation.step(32)

    assert cylinder.place.translation == (0.8, 0.8, 0.2)
    assert simulation.robots[0].sensors["ir1"].value == pytest.approx(0.31, rel=0.05)


def test_reset_physics_is_at_once_and_keeps_time_and_place(simulation):
    """As in Webots, the call only stops all motion, and needs no step."""
    drive(simulation, 2.0, 0.0, 0.0)
    simulation.step(320)
    place = simulation.robots[0].place.translation

    simulation.reset_physics()

    assert simulation.robots[0].body.velocity == (0.0, 0.0, 0.0)
    assert simulation.robots[0].place.translation == place
    assert simulation.time_ms == 320


def test_it_is_small():
    """Many stubs run on one machine.

    A whole stub needs less than 120 MB, and the simulation less than 40 MB.
    """
    program = (
        "import pathlib, sys; from palaestra_sim.scene.simulation import Simulation;"
        "from palaestra_sim.stub.physics import StubPhysics;"
        "from palaestra_sim.world import builtin;"
        "Simulation.load(builtin('arena'), StubPhysics()).step(192);"
        "status = pathlib.Path('/proc/self/status').read_text();"
        "print(status.split('VmHWM:')[1].split()[0], 'numpy' in sys.modules)"
    )
    command = [sys.executable, "-c", program]
    answer = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    kilobytes, has_numpy = answer.stdout.split()

    assert int(kilobytes) < 40_000
    assert has_numpy == "False"
