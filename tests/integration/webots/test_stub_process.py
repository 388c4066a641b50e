"""The stub as a program: its output, its end, and its requests to the ROS master."""

import os
import signal
import subprocess
import sys
import xmlrpc.client
from pathlib import Path

import pytest

from palaestra_trainer.ros import Master, RosService

DEADLINE_S = 60.0  # the waits take moments on an idle machine
STUB = Path(sys.executable).with_name("palaestra-stub")
WITHOUT_ROS = """
import sys
sys.modules.update(dict.fromkeys(["genmsg", "genpy", "rosgraph", "rosmaster", "rospy"]))  # imports then fail
from palaestra_sim.stub.cli import main
sys.exit(main())
"""
ARENA = Path(__file__).parents[3] / "sim_image/src/palaestra_sim/worlds/arena.wbt"


@pytest.fixture
def stub(master, tmp_path):
    """Yield a function that starts stubs with a ROS name of their own; all are killed at the end."""
    world = tmp_path / "arena.wbt"
    world.write_bytes(ARENA.read_bytes().replace(b"--name=robotino", b"--name=process_test"))
    started = []

    def start(*options, uri=master, program=(STUB,)):
        environment = {**os.environ, "ROS_MASTER_URI": uri}
        command = [*program, *options, world]
        process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def ready(process):
    """Wait for the line about running controllers, and return the service for the simulated time."""
    line = process.stderr.readline()
    assert "process_test" in line
    return RosService("/process_test/robot/get_time", "webots_ros/get_float")


def test_it_runs_where_no_ros_is_installed(stub):
    """The stub must run on a laptop without ROS, where only a ROS master is needed as another program."""
    process = stub(program=(sys.executable, "-c", WITHOUT_ROS))
    get_time = ready(process)

    assert get_time(ask=True).value == 0.0
    get_time.close()


def test_sigterm_ends_it_in_good_order(stub):
    """The master must no longer list the names, or clients would look for the next simulator there."""
    process = stub()
    ready(process)

    process.send_signal(signal.SIGTERM)

    assert process.wait(DEADLINE_S) == 0
    assert Master("/test").service_address("/process_test/robot/get_time") is None


def test_a_client_can_choose_the_exit_status(stub):
    """Webots' service `simulation_quit` has this argument."""
    process = stub()
    ready(process)
    quit_ = RosService("/process_test/supervisor/simulation_quit", "webots_ros/set_int")

    assert quit_(value=7).success
    quit_.close()

    assert process.wait(DEADLINE_S) == 7


def test_without_a_master_it_says_so_and_ends(stub):
    """A simulation without a master would run, and no client could reach it."""
    process = stub(uri="http://localhost:1")

    assert process.wait(DEADLINE_S) == 1
    assert "no ROS master at http://localhost:1" in process.stderr.read()


def test_the_error_for_an_invalid_world_has_its_line(master, tmp_path):
    """With the line number, the author finds the mistake in the world file."""
    del master
    world = tmp_path / "broken.wbt"
    world.write_text("#VRML_SIM R2023b utf8\nRobot {\n  name 3 {\n}\n")

    result = subprocess.run([STUB, world], capture_output=True, text=True, timeout=20, check=False)

    assert result.returncode == 2
    assert "broken.wbt:3:" in result.stderr


def test_all_refusals_of_a_world_are_printed_and_the_last_line_sums_them_up(master, tmp_path):
    """A user reads all lines, and a sidecar reports only the last one."""
    del master
    world = tmp_path / "forest.wbt"
    world.write_text("#VRML_SIM R2023b utf8\nColosseum { }\nMinotaur { }\nMinotaur { }\n")

    result = subprocess.run([STUB, world], capture_output=True, text=True, timeout=20, check=False)
    *refusals, last = result.stderr.splitlines()

    assert result.returncode == 2
    assert [line.partition(";")[0] for line in refusals] == [
        "forest.wbt:2:1: the stub simulates no Colosseum",
        "forest.wbt:3:1: the stub simulates no Minotaur (2 places, in lines 3, 4)",
    ]
    assert last.startswith("palaestra-stub: forest.wbt: 3 places are refused, the first is forest.wbt:2:1: ")


def test_a_second_one_of_the_same_name_takes_the_name(stub):
    """By the rules of ROS 1, the older node must shut down, but its simulation continues."""
    older = stub()
    ready(older)
    newer = stub()
    get_time = ready(newer)

    line = older.stderr.readline()

    assert "the node process_test was shut down" in line
    assert "new node registered with same name" in line
    assert get_time(ask=True).value == 0.0
    get_time.close()


def test_a_node_that_rosnode_kill_ends_is_reported_as_shut_down(master, stub):
    """`rosnode kill` sends this request, and the user must learn why the robot has no controller."""
    process = stub()
    ready(process)
    with xmlrpc.client.ServerProxy(master) as ask_master:
        _, _, address = ask_master.lookupNode("/test", "/process_test")
    with xmlrpc.client.ServerProxy(address) as node:
        node.shutdown("/master", "[/gone] Reason: new node registered with same name")  # for another node
        node.shutdown("/rosnode", "user request")

    line = process.stderr.readline()

    assert "the node process_test was shut down (user request); its robot no longer has a controller" in line
