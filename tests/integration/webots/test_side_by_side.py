"""Two simulators of one world with one ROS master, as in a notebook; each facade drives its own."""

import os
import signal
import socket
import subprocess
import sys
import threading
import xmlrpc.client

import pytest

from palaestra_trainer.errors import ConfigurationError, SimulatorDead
from palaestra_trainer.robots import Movement, Pose
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.ros import Master
from palaestra_trainer.webots import Attached
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from palaestra_trainer.webots.launching.ros_name_locks import Reservation

START = Pose(0.0, 0.0, 0.0)
DEADLINE_S = 60.0
_OF_ANOTHER_MASTER = (
    b"HTTP/1.0 200 OK\r\n\r\n"
    + xmlrpc.client.dumps(([1, "", "http://localhost:1/"],), methodresponse=True).encode()
)


def test_two_facades_of_one_world_drive_a_simulator_each(make, name):
    """The second facade must choose the next free name and report it."""
    first, second = make(), make()
    robots = [Robotino(webots) for webots in (first, second)]
    scenes = [SimulatedScene(webots, robot) for webots, robot in zip((first, second), robots, strict=True)]

    with first, second:
        for scene in scenes:
            scene.reset(1, START, (1.0, 1.5))
        robots[0].move(Movement.FORWARD)
        for _ in range(5):
            robots[0].advance()
            robots[1].advance()

    assert (first.robot_name, second.robot_name) == (name, f"{name}_2")
    assert [robot.node_name for robot in robots] == [name, f"{name}_2"]
    assert robots[0].pose().x_m > 0.3
    assert robots[1].pose().x_m == pytest.approx(0.0, abs=1e-6)

    second.stop()

    assert first.available()
    first.stop()
    for robot in robots:
        robot.close()


def test_a_name_is_free_again_once_its_facade_is_closed(make, name):
    """If closed facades kept their names, each repetition of a notebook's cell would get a higher number."""
    first = make()
    first.close()

    assert make().robot_name == name


def test_the_name_of_a_simulator_that_was_killed_is_free(make, world, name):
    """The master still lists the name, but no node responds under it."""
    launcher = ProcessLauncher(world)
    make(launcher=launcher).start()
    os.kill(launcher.state().pid, signal.SIGKILL)
    launcher.close()

    assert make().robot_name == name


def test_a_name_that_another_program_has_reserved_is_not_taken(make, master, name):
    """Two notebooks that start at the same time must not choose the same name."""
    code = (
        "from palaestra_trainer.webots.launching.ros_name_locks import Reservation\n"
        "held = Reservation()\n"
        f"print(held.take([{name!r}]), flush=True)\n"
        "input()\n"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code],
        env={**os.environ, "ROS_MASTER_URI": master},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert other.stdout.readline() == "True\n"

        assert make().robot_name == f"{name}_2"
    finally:
        other.communicate("\n", timeout=DEADLINE_S)
    assert Reservation().take([name])


def test_a_simulator_that_runs_is_used_with_an_attached_launcher_only(make):
    """The attached facade must never stop a simulator that another program owns."""
    owner = make()
    owner.start()
    guest = make(launcher=Attached())

    with guest:
        assert guest.observer.time() == owner.observer.time()
    with pytest.raises(ConfigurationError, match="cannot stop a simulator; stop it where"):
        guest.stop()

    assert owner.available()
    owner.stop()


def test_attaching_to_nothing_says_so_at_once(make):
    """An attached facade cannot start a simulator, so a wait would be useless."""
    with pytest.raises(SimulatorDead, match="no simulator responds under this name"):
        make(launcher=Attached()).start()


def test_a_node_that_does_not_run_is_known_as_such(master):
    """The registration of a killed node stays, so the node itself must be asked."""
    del master
    assert not Master("/test").runs("/nobody")


@pytest.mark.parametrize(
    "response",
    [b"HTTP/1.0 404 Not Found\r\n\r\n", _OF_ANOTHER_MASTER],
    ids=["another program", "a node of another master"],
)
def test_the_name_of_a_killed_node_is_free_when_another_program_has_its_port(master, name, response):
    """The kernel may give the port to another program, which then responds to the request."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        uri = f"http://127.0.0.1:{server.getsockname()[1]}/"
        with xmlrpc.client.ServerProxy(master) as registry:
            registry.registerService(f"/{name}", "/of_a_killed_node", "rosrpc://127.0.0.1:1", uri)
        responding = threading.Thread(target=_respond_once, args=(server, response), daemon=True)
        responding.start()

        runs = Master("/test").runs(f"/{name}")
        responding.join(DEADLINE_S)

    assert not runs


def _respond_once(server, response):
    connection, _ = server.accept()
    with connection:
        connection.recv(4096)
        connection.sendall(response)
