"""The requests of a sidecar to its simulator on behalf of viewers: seldom, bounded, and harmless."""

import contextlib
import socket
import threading
import time

import pytest

from palaestra_sim.ros.local_socket import LocalSocket
from palaestra_sim.ros.loop import Loop
from palaestra_sim.sidecar import viewing
from palaestra_sim.sidecar.viewing import NothingToSee, SimulatorSilent, Viewing

LARGE = b"x" * 5_000_000  # more than a socket holds


class Simulator:
    """A simulator's loop in a thread, which answers requests for viewers and counts them."""

    def __init__(self, path):
        self.asked = []
        self.sick = False
        self.loop = Loop()
        self.socket = LocalSocket(
            self.loop, path, {b"scene": self.scene, b"state": self.state, b"camera": self.camera}
        )
        self.thread = threading.Thread(target=self.loop.run)
        self.thread.start()

    def scene(self):
        """Return a scene that is larger than the buffer of a socket."""
        self.asked.append("scene")
        return LARGE

    def state(self):
        """Return the number of the request, or raise an error if `sick` is set."""
        self.asked.append("state")
        if self.sick:
            raise ZeroDivisionError
        return b"%d" % len(self.asked)

    def camera(self):
        """Return the number of the request."""
        self.asked.append("camera")
        return b"%d" % len(self.asked)

    def end(self):
        """End the loop and close its socket."""
        self.loop.post(self.loop.stop)
        self.thread.join(10.0)
        self.socket.close()
        self.loop.close()


@pytest.fixture
def path(tmp_path):
    """Return a path that is longer than the address of a socket may be."""
    folder = tmp_path / ("deep" * 40)
    folder.mkdir()
    return folder / "collect-0.view"


@pytest.fixture
def simulator(path):
    """Yield a running simulator that answers requests for viewers."""
    running = Simulator(path)
    yield running
    running.end()


@pytest.fixture
def now():
    """Return a list with the time of the viewing's clock, which a test may change."""
    return [100.0]


@pytest.fixture
def view(path, now):
    """Yield the sidecar's side of the connection, with a clock that the test sets."""
    one = Viewing(path, clock=lambda: now[0])
    yield one
    one.close()


def test_nothing_is_computed_before_a_request(simulator):
    """A run without a viewer must not be slower."""
    time.sleep(0.05)

    assert simulator.asked == []


@pytest.mark.usefixtures("simulator")
def test_a_large_scene_arrives_whole(view):
    """The loop sends as much as the sidecar reads, and steps the simulation in between."""
    assert view.scene() == LARGE


def test_many_viewers_cost_as_much_as_one(simulator, view, now):
    """The simulator computes at most 30 states a second; more requests get the last state again."""
    seen = {view.state() for _ in range(50)}
    assert len(seen) == 1

    now[0] += 1.0 / 30.0
    assert view.state() not in seen
    assert simulator.asked == ["state", "state"]


def test_a_picture_is_asked_for_at_most_five_times_a_second(simulator, view, now):
    """The simulator needs time to shrink a picture, so more requests get the last picture again."""
    seen = {view.camera() for _ in range(50)}
    now[0] += 0.19
    assert {view.camera()} == seen

    now[0] += 0.02
    assert view.camera() not in seen
    assert simulator.asked == ["camera", "camera"]


def test_a_scene_that_cannot_be_described_ends_no_simulator(simulator, view):
    """An error while the simulator describes its world must not end the training."""
    simulator.sick = True
    with pytest.raises(SimulatorSilent, match="could not describe its world; its log has the reason"):
        view.state()

    simulator.sick = False
    assert view.state() == b"3", "the next request is answered"


@pytest.mark.parametrize("line", [b"quit\n", b"state\nstate\n", b"x" * 100])
@pytest.mark.usefixtures("simulator")
def test_another_request_closes_its_connection(path, line):
    """Any program of the container may open the socket and send any request."""
    with viewing._connected(path) as connection:
        connection.settimeout(10.0)
        connection.sendall(line)
        with contextlib.suppress(ConnectionResetError):
            assert connection.recv(1) == b""


def test_a_simulator_that_does_not_run_is_told(view):
    """The sidecar has only the path of the socket, on which no program listens."""
    with pytest.raises(SimulatorSilent, match="does not run"):
        view.state()


def test_the_next_simulator_is_seen_after_a_restart(path, view, now):
    """The connection to the first simulator is broken, so the sidecar connects again."""
    first = Simulator(path)
    view.state()
    first.end()
    second = Simulator(path)
    now[0] += 1.0
    try:
        assert view.state() == b"1"
    finally:
        second.end()


def test_a_simulator_that_hangs_is_told_in_time(path, view, monkeypatch):
    """A viewer must get an error after the deadline, instead of waiting for a simulator that hangs."""
    monkeypatch.setattr(viewing, "_DEADLINE_S", 0.1)
    with socket.socket(socket.AF_UNIX) as listener:
        folder = path.parent
        monkeypatch.chdir(folder)
        listener.bind(path.name)
        listener.listen()

        with pytest.raises(SimulatorSilent, match=r"did not respond within 0\.1 s"):
            view.state()


def test_a_simulator_without_a_scene_is_explained_in_one_sentence():
    """A person who wants to view Webots gets an error that names a driver with a view."""
    nothing = Viewing.without("driver webots does not describe its world to viewers; use driver stub")

    with pytest.raises(NothingToSee, match="use driver stub"):
        nothing.scene()
