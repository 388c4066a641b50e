"""A step of move-to-target over ROS by three clients in turns: only bytes, the robot, and the environment.

Each of them sends three wheel commands, one time_step and two requests for the pose, and reads ten sensors.
`floor` moves only bytes. `robot` uses the facade of the robot. `environment` steps the vector environment of
a training with a policy that costs nothing.
"""

import itertools
import os
import statistics
import time
from pathlib import Path

import numpy as np

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.run.telemetry.goodput import GoodputLedger
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.simulators.restarter import Restarter
from tests.bench.arena import running
from tests.bench.parallel import MOVEMENTS, Member
from tests.bench.raw_client import TURNS_RAD_S, RawClient
from tests.bench.sizes import scaled
from tests.local_run import REAPER, below

ROUNDS = 15
STEPS = 500
WARM_STEPS = 50
P99 = 99


class LedgerWatcher(NullWatcher):
    """Counts the time of the vector environment in the ledger of a run."""

    def __init__(self):
        self.ledger = GoodputLedger()

    def spending(self, cause):
        """Count the time in the context under `cause`."""
        return self.ledger.spending(cause)


def measure(scale=1.0):
    """Return figures of each client per step, and the medians of the rounds' ratios to the floor."""
    steps = scaled(STEPS, scale)
    with running() as (robot, scene, _):
        clients = {"floor": Raw(robot), "robot": Facade(robot), "environment": Vector(robot, scene)}
        pid = simulator()
        rounds = [
            {name: Phase(client, pid, steps) for name, client in clients.items()}
            for _ in range(scaled(ROUNDS, scale))
        ]
        ledger = clients["environment"].per_step_ms()
    found = {name: figures([each[name] for each in rounds]) for name in clients}
    for name in ("robot", "environment"):
        ratios = [each[name].median_s / each["floor"].median_s for each in rounds]
        found[name]["times_floor"] = round(statistics.median(ratios), 2)
    return found | ledger


class Raw:
    """The client that moves only bytes; before it connects, the robot enables its sensors."""

    def __init__(self, robot):
        self._robot = robot

    def begin(self):
        """Connect, and return the function that steps."""
        self._robot.connect()
        self._robot.close()
        self._client = RawClient(self._robot.node_name)
        return self._client.step

    def end(self):
        """Disconnect."""
        self._client.close()


class Facade:
    """Palaestra's facade of the robot."""

    def __init__(self, robot):
        self._robot = robot

    def begin(self):
        """Connect, and return the function that steps."""
        robot, turns = self._robot, itertools.cycle(TURNS_RAD_S)
        robot.connect()

        def step():
            robot.drive(0.0, 0.0, next(turns))
            robot.advance()
            robot.pose()

        return step

    def end(self):
        """Disconnect."""
        self._robot.close()


class Vector:
    """The vector environment of a training with one simulator."""

    def __init__(self, robot, scene):
        self._robot = robot
        self._watcher = LedgerWatcher()
        restarter = Restarter(Member("collect-0", robot, scene), watcher=self._watcher)
        self._env = SimulatorsVecEnv([restarter], 0)
        self._spent = dict.fromkeys((Cause.STEPPING, Cause.TRANSPORT), 0.0)
        self._steps = 0

    def begin(self):
        """Connect, begin an episode, and return the function that steps."""
        self._robot.connect()
        self._env.reset()
        self._before = self._watcher.ledger.seconds()
        actions = itertools.cycle([np.full(1, number) for number in range(len(MOVEMENTS))])
        env = self._env

        def step():
            self._steps += 1
            env.step(next(actions))

        return step

    def end(self):
        """Disconnect, and count the time of the steps."""
        after = self._watcher.ledger.seconds()
        for cause in self._spent:
            self._spent[cause] += after[cause.value] - self._before[cause.value]
        self._robot.close()

    def per_step_ms(self):
        """Return the means of the ledger's causes over all steps, in ms."""
        return {
            f"{cause.value}_ms": round(1000.0 * spent / self._steps, 3)
            for cause, spent in self._spent.items()
        }


class Phase:
    """Some steps of one client, with the duration of each step and the processor time of both processes."""

    def __init__(self, client, simulator, steps):
        step = client.begin()
        for _ in range(min(steps, WARM_STEPS)):
            step()
        ours_s, theirs_s = time.thread_time(), processor_s(simulator)
        self.durations_s = [timed(step) for _ in range(steps)]
        self.client_s = (time.thread_time() - ours_s) / steps
        self.simulator_s = (processor_s(simulator) - theirs_s) / steps
        client.end()
        self.median_s = statistics.median(self.durations_s)


def figures(phases):
    """Return the figures of one client in microseconds: medians of the rounds' values."""
    durations_s = [each for phase in phases for each in phase.durations_s]
    return {
        "median_us": us(statistics.median(phase.median_s for phase in phases)),
        "p99_us": us(float(np.percentile(durations_s, P99))),
        "client_processor_us": us(statistics.median(phase.client_s for phase in phases)),
        "simulator_processor_us": us(statistics.median(phase.simulator_s for phase in phases)),
    }


def timed(step):
    """Return the seconds of one call."""
    began = time.perf_counter()
    step()
    return time.perf_counter() - began


def simulator():
    """Return the process id of the simulator that this process has started."""
    [pid] = [
        pid
        for pid, words in below(os.getpid())
        if any(word.endswith("palaestra-stub") for word in words[:2])
        and not any(REAPER in word for word in words)
    ]
    return pid


def processor_s(pid):
    """Return the processor time of a process."""
    return int(Path(f"/proc/{pid}/schedstat").read_text().split()[0]) / 1e9


def us(seconds):
    """Return seconds in whole microseconds."""
    return round(1e6 * seconds)
