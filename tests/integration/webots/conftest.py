"""A stub simulator that a test starts as a notebook does."""

import uuid
from contextlib import ExitStack

import pytest

from palaestra_sim.world import builtin
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Mode, Webots
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher

DEADLINE_S = 60.0


class Simulator:
    """A running simulator whose facade has a short timeout."""

    def __init__(self, *options, world="arena", supervisor="robotino"):
        self.launcher = ProcessLauncher(world, options=options)
        self.webots = Webots(supervisor, world, launcher=self.launcher, start_deadline_s=20.0)
        self.webots.start()

    def close(self):
        """End the simulator and its sidecar."""
        self.webots.stop()
        self.webots.close()
        self.launcher.close()


class Setup:
    """A robot and its scene in a running simulator."""

    def __init__(self, simulator, robot=None):
        self.launcher, self.webots = simulator.launcher, simulator.webots
        self.webots.supervisor.set_mode(Mode.FAST)
        self.robot = Robotino(self.webots, robot)
        self.scene = SimulatedScene(self.webots, self.robot)
        self.robot.connect()

    @property
    def pid(self):
        """Return the simulator's process id."""
        return self.launcher.state().pid


class Standing:
    """A simulator that several tests share. It must end before another simulator with its names starts."""

    def __init__(self):
        self._simulator = None

    def simulator(self):
        """Start the simulator if it does not run, and return it."""
        if self._simulator is None:
            self._simulator = Simulator()
        return self._simulator

    def go(self):
        """End the simulator; the next test that needs one starts it again."""
        if self._simulator is not None:
            self._simulator.close()
            self._simulator = None


@pytest.fixture(scope="module")
def standing(master):
    """Yield the included arena for all tests of a module; it starts on demand."""
    del master
    one = Standing()
    yield one
    one.go()


@pytest.fixture
def start(standing):
    """Yield a function that starts simulators with options; they end with the test."""
    standing.go()
    with ExitStack() as started:

        def make(*options, robot=None, **where):
            simulator = Simulator(*options, **where)
            started.callback(simulator.close)
            setup = Setup(simulator, robot)
            started.callback(setup.robot.close)
            return setup

        yield make


@pytest.fixture
def arena(standing):
    """Yield the shared arena in its initial state; tests that stop the simulator use `own_arena`."""
    setup = Setup(standing.simulator())
    yield setup
    with setup.webots:
        setup.robot.simulation.reset(seed=0)
    setup.robot.close()


@pytest.fixture
def own_arena(start):
    """Yield an included arena that runs only for this test; the test may stop it."""
    return start()


@pytest.fixture
def name():
    """Return a ROS name that only this test uses, because all tests share a master."""
    return f"rover_{uuid.uuid4().hex[:8]}"


@pytest.fixture
def world(master, tmp_path, name):
    """Return the path of an arena whose robot has this ROS name."""
    del master
    path = tmp_path / "arena.wbt"
    path.write_bytes(builtin("arena").replace(b"--name=robotino", f"--name={name}".encode()))
    return path


@pytest.fixture
def make(world, name):
    """Yield a function that creates facades of that world."""
    made = []

    def begin(world=world, **options):
        made.append(Webots(name, world, start_deadline_s=DEADLINE_S, **options))
        return made[-1]

    yield begin
    for webots in made:
        webots.close()
