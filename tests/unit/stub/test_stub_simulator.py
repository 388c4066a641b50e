"""The life of a stub: reload, load, restart, quit, and the arguments in controllerArgs."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.ros_controller.simulator import RunningSimulator
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin


def test_a_controller_starts_for_each_ros_robot(ros, start):
    """The names of the controllers' nodes come from controllerArgs."""
    simulator = start(builtin("two_robots"))

    assert list(simulator.controllers) == ["supervisor", "robotino"]
    assert [node.name for node in ros.nodes] == ["supervisor", "robotino"]


def test_robots_with_other_controllers_are_left_alone(ros, start, world, simple_robot):
    """Robots with other controllers do not move, and no step waits for them."""
    start(world('Robot { name "statue" controller "<none>" }', robot=simple_robot))

    assert [node.name for node in ros.nodes] == ["robotino"]
    assert ros.node("robotino").get("robot/time_step", value=32) is True


def test_nothing_starts_from_a_wrong_world(ros, tmp_path):
    """The stub rejects the world before it registers any node."""
    path = tmp_path / "bad.wbt"
    path.write_bytes(b"#VRML_SIM R2023b utf8\nColosseum { }\n")

    with pytest.raises(WorldError, match=r"bad.wbt:2:1: the stub simulates no Colosseum"):
        RunningSimulator(path, Loader(physics=StubPhysics), ros.make_node)

    assert ros.nodes == []


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        (('"--name=robotino" ', ""), "controllerArgs without --name=; add --name=NAME"),
        (('"--synchronize"', ""), "controllerArgs without --synchronize"),
        (('"--synchronize"', '"--synchronize" "--use-sim-time"'), "the stub does not know --use-sim-time"),
        (('"--synchronize"', '"--synchronize" "--use-ros-control"'), "does not know --use-ros-control"),
    ],
)
def test_arguments_that_the_stub_cannot_follow_are_refused(start, world, simple_robot, change, fact):
    """The stub cannot simulate a robot that is not synchronized, or that has another controller."""
    with pytest.raises(WorldError, match=fact):
        start(world(robot=simple_robot.replace(*change)))


def test_unknown_arguments_are_ignored(ros, start, world, simple_robot):
    """The real controller logs an unknown argument and continues."""
    start(world(robot=simple_robot.replace('"--synchronize"', '"--synchronize" "--speed=7"')))

    assert ros.node("robotino").get("robot/get_time") == 0.0


def test_a_reload_ends_the_controllers_and_starts_new_ones(ros, start):
    """Services disappear and come back, sensors are disabled, and the world is as in its file."""
    start()
    old = ros.node("robotino")
    old.call("ir1/enable", value=32)
    old.call("robot/time_step", value=320)

    assert old.get("supervisor/world_reload") is True
    new = ros.node("robotino")

    assert old.closed
    assert new is not old
    assert new.get("robot/get_time") == 0.0
    assert new.get("ir1/get_sampling_period") == 0


def test_handles_do_not_survive_a_reload(ros, start):
    """In Webots such a handle is a dangling pointer; here the call fails."""
    start()
    old = ros.node("robotino")
    handle = old.get("supervisor/get_from_def", name="TARGET")
    old.call("supervisor/world_reload")
    new = ros.node("robotino")

    assert new.get("supervisor/get_from_def", name="TARGET") != handle
    with pytest.raises(ServiceFailed, match="does not exist; get a new handle"):
        new.call("supervisor/node/get_position", node=handle)


def test_revert_is_the_old_name_of_reload(ros, start):
    """`revert` is deprecated in Webots, but its controller still serves it."""
    start()

    ros.node("robotino").call("supervisor/simulation_revert")

    assert len(ros.nodes) == 2


def test_a_reload_reads_the_file_again(ros, start):
    """A change of the file takes effect; the mode of the simulation stays."""
    simulator = start(mode=Mode.FAST)
    text = simulator.world_path.read_bytes()
    simulator.world_path.write_bytes(text.replace(b"basicTimeStep 32", b"basicTimeStep 16"))

    ros.node("robotino").call("supervisor/world_reload")

    assert ros.node("robotino").get("robot/get_basic_time_step") == 16.0
    assert ros.node("robotino").get("supervisor/simulation_get_mode") == Mode.FAST


def test_another_world_can_be_loaded(ros, start, world, tmp_path):
    """A supervisor may load the next world of a curriculum without a restart of the simulator."""
    start()
    other = tmp_path / "other.wbt"
    other.write_bytes(world())

    assert ros.node("robotino").get("supervisor/world_load", value=str(other)) is True
    assert ros.node("robotino").get("robot/get_world_path") == str(other)
    assert ros.node("robotino").get("robot/get_number_of_devices") == 8


@pytest.mark.parametrize("content", [None, b"", b"#VRML_SIM R2023b utf8\nSphere { }"])
def test_a_world_that_cannot_be_loaded_leaves_the_present_one(ros, start, tmp_path, content):
    """The file may be missing or empty, or the stub cannot simulate its world."""
    start()
    other = tmp_path / "other.wbt"
    if content is not None:
        other.write_bytes(content)

    assert ros.node("robotino").get("supervisor/world_load", value=str(other)) is False
    assert len(ros.nodes) == 1
    assert ros.node("robotino").get("robot/time_step", value=32) is True


def test_a_reload_with_two_robots_restarts_both(two_robots, ros):
    """After the reload, a step waits for both robots again."""
    supervisor, _ = two_robots

    supervisor.call("supervisor/world_reload")
    pending = ros.node("supervisor").ask("robot/time_step", value=32)
    ros.advance(1)
    assert pending not in ros.node("supervisor").answers
    ros.node("robotino").call("robot/time_step", value=32)

    assert ros.node("supervisor").answers[pending].success is True


def test_one_controller_can_be_restarted_alone(two_robots, ros):
    """The world and the other robot's controller continue."""
    supervisor, robotino = two_robots
    handle = supervisor.get("supervisor/get_from_def", name="ROBOTINO")
    for node in (supervisor, robotino):
        node.ask("robot/time_step", value=32)
    ros.advance(0)

    assert supervisor.get("supervisor/node/restart_controller", node=handle) == 1

    assert robotino.closed
    assert not supervisor.closed
    assert ros.node("robotino").get("robot/get_time") == pytest.approx(0.032)


def test_restarting_the_controller_of_what_is_no_robot_does_nothing(two_robots):
    """Webots logs that the node is not a robot, but the call still succeeds."""
    supervisor, robotino = two_robots
    handle = supervisor.get("supervisor/get_from_def", name="TARGET")

    assert supervisor.get("supervisor/node/restart_controller", node=handle) == 1
    assert not supervisor.closed
    assert not robotino.closed


def test_quit_tells_the_process_its_exit_status(ros, start):
    """The client gets the response before the simulator ends."""
    simulator = start()
    statuses = []
    simulator.on_quit(statuses.append)
    robot = ros.node("robotino")

    number = robot.ask("supervisor/simulation_quit", value=3)
    assert robot.answers[number].success is True
    assert statuses == []
    ros.advance(0)

    assert statuses == [3]
    assert simulator.quit_status == 3


def test_quit_ends_pending_steps_without_success(two_robots):
    """wb_robot_step returns -1 in the real controller, and the controller ends."""
    supervisor, robotino = two_robots
    pending = robotino.ask("robot/time_step", value=32)

    supervisor.call("supervisor/simulation_quit", value=0)

    assert robotino.answers[pending].success is False


def test_quitting_twice_keeps_the_first_status(ros, start):
    """The simulator already ends when the second request arrives, so only the first status counts."""
    simulator = start()
    robot = ros.node("robotino")

    robot.ask("supervisor/simulation_quit", value=0)
    robot.ask("supervisor/simulation_quit", value=1)
    ros.advance(0)

    assert simulator.quit_status == 0


def test_closing_ends_every_controller(ros, start):
    """As on SIGTERM, each controller unregisters its services before the process ends."""
    simulator = start(builtin("two_robots"))

    simulator.close()

    assert simulator.controllers == {}
    assert all(node.closed for node in ros.nodes)


def test_messages_that_were_due_at_a_reload_never_come(ros, start):
    """The reload has ended the controller that would send these messages."""
    start(publish_delay_s=0.01)
    old = ros.node("robotino")
    inbox = old.inbox("ir1/value")
    old.call("ir1/enable", value=32)
    old.call("robot/time_step", value=32)

    old.call("supervisor/world_reload")
    ros.advance(1)

    assert inbox == []


def test_a_step_that_sleeps_through_a_restart_is_not_answered(ros, start):
    """When the sleep ends, the connection is already closed."""
    start(builtin("two_robots"), step_sleep_s=0.01)
    supervisor, robotino = ros.node("supervisor"), ros.node("robotino")
    numbers = [node.ask("robot/time_step", value=32) for node in (supervisor, robotino)]
    ros.advance(0.02)
    assert [n in node.answers for n, node in zip(numbers, (supervisor, robotino), strict=True)] == [True] * 2

    handle = supervisor.get("supervisor/get_from_def", name="ROBOTINO")
    sleeping = robotino.ask("robot/time_step", value=32)
    supervisor.call("supervisor/node/restart_controller", node=handle)
    ros.advance(1)

    assert sleeping not in robotino.answers


def test_reset_through_the_supervisor_needs_a_step(robot, drive, position):
    """The call sets a flag, and the reset happens in the next basic step; no controller restarts."""
    drive(robot, 0.3, 0.0, 0.0)
    robot.call("ir1/enable", value=192)
    inbox = robot.inbox("ir1/value")
    robot.call("robot/time_step", value=192)

    assert robot.get("supervisor/simulation_reset") is True
    assert position(robot, "ROBOTINO")[0] > 0.0
    robot.call("robot/time_step", value=192)

    assert position(robot, "ROBOTINO") == (0.0, 0.0, 0.0)
    assert robot.get("ir1/get_sampling_period") == 192
    assert robot.get("wheel0_joint/get_target_position") == 0.0
    assert len(inbox) == 2


def test_reset_physics_through_the_supervisor_is_at_once(robot, drive):
    """Unlike `simulation_reset`, this call needs no step."""
    drive(robot, 1.0, 0.0, 0.0)
    robot.call("robot/time_step", value=320)
    handle = robot.get("supervisor/get_self")

    assert robot.get("supervisor/simulation_reset_physics") is True

    assert robot.get("supervisor/node/get_velocity", node=handle).linear.x == 0.0
