"""Stubs with faults, and Palaestra's own robot as their client."""

import os
import subprocess
import sys
import time
import uuid
from pathlib import Path

import pytest

from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.ros import Master, RosService
from palaestra_trainer.webots import Mode, Webots
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher

DEADLINE_S = 60.0  # the waits take moments on an idle machine
STUB = Path(sys.executable).with_name("palaestra-stub")
ARENA = Path(__file__).parents[3] / "sim_image/src/palaestra_sim/worlds/arena.wbt"


class Player:
    """A simulator with faults in a sidecar, and the robot in it.

    Attributes:
        fault: the facade's error at the first failure, or None if no failure occurred.
        durations_s: the durations of all steps with a response.
        extra_steps: the number of extra steps among them.
    """

    def __init__(self, *options):
        self.launcher = ProcessLauncher("arena", options=options)
        self.webots = Webots("robotino", "arena", launcher=self.launcher, start_deadline_s=20.0)
        self.robot = Robotino(self.webots)
        self.scene = SimulatedScene(self.webots, self.robot)
        self.fault = None
        self.durations_s = []
        self.extra_steps = 0
        self.memory_mib = []

    def play(self, episodes=26, steps=2):
        """Start the simulator, run episodes until a failure occurs, and connect once more."""
        try:
            self.start()
            for number in range(episodes):
                self.scene.reset(number, Pose(0.0, 0.0, 0.0), (1.0, 1.0))
                for _ in range(steps):
                    self.step()
            self.robot.connect()
        except SimulatorFault as fault:
            self.fault = fault
        return self

    def start(self):
        """Start the simulator and connect to it."""
        self.webots.start()
        self.webots.supervisor.set_mode(Mode.FAST)
        self.memory_mib.append(self.resident_mib())

    def step(self):
        """Take one step, and record its duration."""
        began = time.monotonic()
        self.extra_steps += self.robot.advance()
        self.robot.pose()
        self.durations_s.append(time.monotonic() - began)
        self.memory_mib.append(self.resident_mib())

    def resident_mib(self):
        """Return the resident memory, in MiB, of the simulator's first process."""
        pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    @property
    def pid(self):
        """Return the simulator's process id."""
        return self.launcher.state().pid

    def ended(self):
        """Wait for the end of the simulator, and return its exit code or the name of its signal."""
        self.launcher.wait_stopped(DEADLINE_S)
        last = self.launcher.state().last_exit
        return last.code if last.signal is None else last.signal

    def close(self):
        """End the simulator and its sidecar."""
        self.robot.close()
        self.webots.close()
        self.launcher.close()


@pytest.fixture
def player(master):
    """Yield `player("crash:step=20", ...)`, which returns a `Player`.

    By default, the simulator is in its first life.
    """
    del master
    made = []

    def make(*faults, life=1):
        options = [f"--fault={fault}" for fault in faults]
        made.append(Player(*options, f"--fault-life={life}"))
        return made[-1]

    yield make
    for each in made:
        each.close()


class Stubs:
    """Starts stubs without a sidecar; no other test has registered their name at the master.

    Attributes:
        name: the name of their robot.
    """

    def __init__(self, master, folder):
        self.name = f"faulty_{uuid.uuid4().hex[:8]}"
        self._variables = {**os.environ, "ROS_MASTER_URI": master}
        self._world = folder / "arena.wbt"
        self._world.write_bytes(
            ARENA.read_bytes().replace(b"--name=robotino", b"--name=" + self.name.encode())
        )
        self._started = []

    def __call__(self, *options, **variables):
        """Start a stub, and return the process."""
        command = [STUB, *options, self._world]
        environment = {**self._variables, **variables}
        self._started.append(subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True))
        return self._started[-1]

    def service(self, path, type_name):
        """Return a service of the stubs' robot."""
        return RosService(f"/{self.name}/{path}", f"webots_ros/{type_name}")

    def registered(self):
        """Return whether the master lists a service of the robot."""
        return Master("/test").service_address(f"/{self.name}/robot/get_time") is not None

    def close(self):
        """Kill the stubs that still run."""
        for process in self._started:
            process.kill()
            process.communicate()


@pytest.fixture
def stub(master, tmp_path):
    """Yield `stub("--fault=...", PALAESTRA_SIMULATOR_START="2")`, which starts a process.

    The process is killed at the end of the test.
    """
    stubs = Stubs(master, tmp_path)
    yield stubs
    stubs.close()
