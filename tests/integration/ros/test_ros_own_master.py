"""Our ROS master as a program: its options and its end. The last test uses rosmaster, as pods do."""

import os
import signal
import socket
import subprocess
import sys
import xmlrpc.client
from contextlib import suppress
from pathlib import Path

import pytest

from tests.local_run import left_of
from tests.waiting import eventually

PROGRAM = Path(sys.executable).with_name("palaestra-ros-master")
OWNED = [sys.executable, "-P", "-m", "palaestra_trainer.ros_master", "--until-stdin-closes"]
PATIENCE_S = 60.0
OWNER = f"""
import subprocess, sys
master = subprocess.Popen({OWNED}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
print(master.pid, master.stdout.readline().decode().strip(), flush=True)
sys.stdin.read()
"""
STEPS = """
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.webots import Webots
webots = Webots("robotino", "arena")
robot = Robotino(webots)
with webots:
    robot.drive(0.1, 0.0, 0.0)
    robot.advance()
    print(len(robot.distances()))
"""


def started(*words, **how):
    """Start a program with pipes for its outputs, and return the process."""
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **how}
    return subprocess.Popen([*map(str, words)], **how)


def test_it_prints_its_address_and_ends_at_a_signal():
    """The program is a container's process, so a normal end must have exit code 0."""
    with started(PROGRAM) as program:
        uri = program.stdout.readline().strip()
        with xmlrpc.client.ServerProxy(uri) as master:
            assert master.getPid("/test")[2] == program.pid
            assert master.getUri("/test")[2] == uri
        program.send_signal(signal.SIGTERM)

        assert program.wait(PATIENCE_S) == 0


@pytest.mark.parametrize(
    ("address", "named", "variables"),
    [
        ("127.0.0.1:0", "127.0.0.1", {}),
        ("0.0.0.0:0", socket.gethostname(), {}),
        ("0.0.0.0:0", "10.1.2.3", {"ROS_IP": "10.1.2.3"}),
        ("127.0.0.2:0", "127.0.0.2", {}),
    ],
)
def test_its_address_has_the_name_that_nodes_would_choose(address, named, variables):
    """Nodes on other machines connect to the name in this address."""
    own = {name: value for name, value in os.environ.items() if name not in ("ROS_HOSTNAME", "ROS_IP")}
    with started(PROGRAM, "--listen", address, env={**own, **variables}) as program:
        uri = program.stdout.readline().strip()
        program.terminate()

    assert uri.rpartition(":")[0] == f"http://{named}"


def test_a_port_in_use_is_one_line():
    """The user has chosen the port, so the program must not try another one."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with started(PROGRAM, "--listen", address) as program:
            _, errors = program.communicate(timeout=PATIENCE_S)

    assert program.returncode == 2
    assert errors == f"--listen: {address}: Address already in use; choose another address\n"


def test_a_kill_of_its_owner_leaves_nothing():
    """When the owner is killed, the kernel closes the pipe to the master, and the master ends."""
    with started(sys.executable, "-c", OWNER, stdin=subprocess.PIPE) as owner:
        pid, uri = owner.stdout.readline().split()
        with xmlrpc.client.ServerProxy(uri) as master:  # this connection stays open
            assert master.getPid("/test")[2] == int(pid)
            owner.kill()

            assert not left_of([int(pid)])


@pytest.fixture
def rosmaster(tmp_path):
    """Start rosmaster as in a pod, and yield its URI."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    environment = {**os.environ, "ROS_HOSTNAME": "localhost", "ROS_LOG_DIR": str(tmp_path)}
    program = started("rosmaster", "--core", "-p", port, env=environment, stderr=subprocess.DEVNULL)
    yield f"http://localhost:{port}"
    program.kill()
    program.communicate()


def test_trainer_and_simulators_work_with_rosmaster_too(rosmaster):
    """A pod runs rosmaster, and a user's machine may do so too."""

    def answers():
        with suppress(OSError), xmlrpc.client.ServerProxy(rosmaster) as master:
            return master.getPid("/test")

    eventually(answers)
    done = subprocess.run(
        [sys.executable, "-c", STEPS],
        env={**os.environ, "ROS_MASTER_URI": rosmaster, "ROS_HOSTNAME": "localhost"},
        stdout=subprocess.PIPE,
        text=True,
        timeout=2 * PATIENCE_S,
        check=True,
    )

    assert done.stdout == "9\n"
