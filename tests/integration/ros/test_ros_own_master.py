"""Our ROS master as a program: its options and how it ends; and rosmaster in its place, as pods have it."""

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
    """Start a program whose output is read."""
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **how}
    return subprocess.Popen([*map(str, words)], **how)


def test_it_prints_its_address_and_ends_at_a_signal():
    """With code 0: it is a container's process."""
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
    """Programs on other machines are told that name."""
    own = {name: value for name, value in os.environ.items() if name not in ("ROS_HOSTNAME", "ROS_IP")}
    with started(PROGRAM, "--listen", address, env={**own, **variables}) as program:
        uri = program.stdout.readline().strip()
        program.terminate()

    assert uri.rpartition(":")[0] == f"http://{named}"


def test_a_port_in_use_is_one_line():
    """A person chose the port, so no other one is tried."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with started(PROGRAM, "--listen", address) as program:
            _, errors = program.communicate(timeout=PATIENCE_S)

    assert program.returncode == 2
    assert errors == f"--listen: {address}: Address already in use; choose another address\n"


def test_a_kill_of_its_owner_leaves_nothing():
    """The kernel closes the pipe between them."""
    with started(sys.executable, "-c", OWNER, stdin=subprocess.PIPE) as owner:
        pid, uri = owner.stdout.readline().split()
        with xmlrpc.client.ServerProxy(uri) as master:  # its connection stays open
            assert master.getPid("/test")[2] == int(pid)
            owner.kill()

            assert not left_of([int(pid)])


@pytest.fixture
def rosmaster(tmp_path):
    """The URI of rosmaster, started as in a pod."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    environment = {**os.environ, "ROS_HOSTNAME": "localhost", "ROS_LOG_DIR": str(tmp_path)}
    program = started("rosmaster", "--core", "-p", port, env=environment, stderr=subprocess.DEVNULL)
    yield f"http://localhost:{port}"
    program.kill()
    program.communicate()


def test_trainer_and_simulators_work_with_rosmaster_too(rosmaster):
    """Pods have it, and so may the machine of a user."""

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
