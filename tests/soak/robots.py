"""A policy on a mock robot: how soon the robot stops, the stops without a cause, and how often it arrives.

The policies are trained first, as a user trains them. The mock robot runs at 20 times real time, except in
the measurements of a stop and of the hour, which run in real time. Run this part alone, because a busy
machine delays the requests, or give it a real-time priority: `chrt -f 20 python -m tests.soak robot`.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import structlog

from palaestra_trainer.errors import RobotStopped
from palaestra_trainer.real_robots.command_loop import Hooks
from palaestra_trainer.real_robots.connect import link_to
from palaestra_trainer.real_robots.deployment import checked_package
from palaestra_trainer.real_robots.rest import RestLink
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.safety import SafetyRules
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.geometry import SPEED_M_S
from tests import cut_network
from tests.dead_man import LIMITS_S, after, ros_master
from tests.mock_episodes import succeeded, tasks
from tests.mock_robots import ended, started
from tests.soak.holds import Holds

TIMES, EPISODES, HOUR_S = 50, 100, 3600.0
SPEED = 20.0
SLOW_SPEED = 10.0  # slower than SPEED, because the robot's 50 ms of delay are only 5 ms of this machine
PERIOD_S = 0.192
CUT = "cut, over ros1"
HOUR_SPEED = 1.0  # a faster robot would count the pauses of this machine's scheduler as late readings
BAD_NETWORK = ("--delay-ms=50", "--timeouts=0.05", "--drift=0.02")
EXAMPLES = Path(__file__).parents[2] / "examples"
MANIFESTS = Path(__file__).parents[2] / "manifests" / "examples"
PROGRAMS = Path(sys.executable).parent
OPEN_LOOP = ((0.3, 0.0, 0.0), (0.0, -0.1, 0.0), (0.2, 0.1, 0.3), (0.0, 0.0, -0.3), (-0.3, 0.0, 0.0))


def measure(scale):
    """Return the figures and claims of this part."""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(30))
    times, episodes = max(round(TIMES * scale), 2), max(round(EPISODES * scale), 4)
    stops = {what: [after(what) for _ in range(times)] for what in LIMITS_S}
    stops[CUT] = [cut_network.after_cut_s() for _ in range(times)]
    limits_s = LIMITS_S | {CUT: cut_network.LIMIT_S}
    holds = holds_of_an_hour(HOUR_S * scale)
    open_loop_m = open_loop()
    with tempfile.TemporaryDirectory() as folder:
        plain, robust = (trained(Path(folder), name) for name in ("move-to-target", "imprecise"))
        arrivals = {
            "plain, over ros1": arrived_over_ros(plain, episodes),
            **simulated(Path(folder) / "runs/move-to-target/0", episodes),
            "plain": arrived(plain, episodes, "--drift=0"),
            "plain, bad network": arrived(plain, episodes, *BAD_NETWORK, speed=SLOW_SPEED),
            "robust, bad network": arrived(robust, episodes, *BAD_NETWORK, speed=SLOW_SPEED),
        }
    return {
        "times": times,
        "episodes": episodes,
        "stands_s": {what: round(max(seconds), 3) for what, seconds in stops.items()},
        "holds_of_an_hour": holds.report(),
        "open_loop_m": open_loop_m,
        "arrived": arrivals,
        "claims": {
            **{
                f"stands within {limit} s: {what}": max(stops[what]) < limit
                for what, limit in limits_s.items()
            },
            "no false stop in an hour with 50 ms of delay": not holds.stops(),
            "open loop within 5 cm over 10 s": open_loop_m < 0.05,
            **{
                f"90 of 100 arrive: {where}": arrivals[where] >= 0.9 * episodes
                for where in ("plain", "plain, over ros1", "plain, in stub", "plain, in mujoco")
            },
            "85 of 100 arrive over a bad network": arrivals["robust, bad network"] >= 0.85 * episodes,
        },
    }


def trained(folder, name):
    """Train the job of an example, and return its package."""
    subprocess.run(
        [PROGRAMS / "palaestra", "run", MANIFESTS / f"{name}.yaml", "--dir", folder / "runs"],
        check=True,
        stdout=subprocess.DEVNULL,
        cwd=EXAMPLES.parent,
    )
    run = folder / "runs" / name / "0"
    importing = {**os.environ, "PYTHONPATH": str(EXAMPLES)}
    exporting = [PROGRAMS / "palaestra-export", run, "--to", "package"]
    subprocess.run(exporting, check=True, stdout=subprocess.DEVNULL, env=importing)
    if str(EXAMPLES) not in sys.path:
        sys.path.append(str(EXAMPLES))
    return checked_package.read(run / "package")


def arrived(package, episodes, *options, speed=SPEED):
    """Return in how many episodes the mock robot truly stands on its target."""
    robot, client = started(f"--speed={speed:g}", *options)
    try:
        wanted = tasks(episodes, seed=7)
        return sum(succeeded(client, package, link_over_rest(client), speed, wanted))
    finally:
        ended(robot, client)


def arrived_over_ros(package, episodes):
    """Return in how many episodes the mock robot stands on its target if its ROS 1 driver drives it."""
    with ros_master() as master:
        options = ("--drift=0", "--ros1", "--max-speed=0.5", f"--speed={SLOW_SPEED:g}")
        robot, client = started(*options, ROS_MASTER_URI=master)
        address = master.replace("http://", "ros1://").rstrip("/")
        try:
            wanted = tasks(episodes, seed=7)
            return sum(
                succeeded(
                    client,
                    package,
                    lambda clock: link_to(address, SensorLayout(), clock),
                    SLOW_SPEED,
                    wanted,
                )
            )
        finally:
            ended(robot, client)


def simulated(run, episodes):
    """Return in how many episodes the policy of a run arrives in the stub and in MuJoCo."""
    command = [PROGRAMS / "palaestra-eval", run, "--in", "stub,mujoco", "--json", "--episodes", str(episodes)]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    results = map(json.loads, lines)
    return {f"plain, in {one['simulator']}": round(one["success_rate"] * episodes) for one in results}


def link_over_rest(client):
    """Return a function that returns a link to a mock robot with a clock."""
    return lambda clock: RestLink(f"http://{client.address}", clock=clock)


def holds_of_an_hour(seconds):
    """Turn the robot to and fro, far from obstacles, with a delay of 50 ms; return the holds and stops."""
    robot, client = started(f"--speed={HOUR_SPEED:g}", "--delay-ms=50", "--drift=0")
    clock = RobotClock(HOUR_SPEED)
    rules = SafetyRules(speed_m_s=SPEED_M_S)
    holds = Holds(clock.now_s, PERIOD_S)
    try:
        link = link_over_rest(client)(clock)
        with RealRobotino(link, rules, PERIOD_S, clock, Hooks(decided=holds.decided)) as real:
            real.connect()
            with suppress(RobotStopped):  # a latched stop, which the holds have recorded
                for step in range(round(seconds / PERIOD_S)):
                    real.drive(0.0, 0.0, 0.5 if step % 20 < 10 else -0.5)
                    real.advance()
    finally:
        ended(robot, client)
    return holds


def open_loop():
    """Drive for 10 s; return the distance in meters between the true pose and the integrated commands."""
    robot, client = started("--speed=4", "--drift=0")
    clock = RobotClock(4.0)
    try:
        with RealRobotino(link_over_rest(client)(clock), SafetyRules(speed_m_s=0.5), clock=clock) as real:
            real.connect()
            periods = round(10.0 / real.period_s / len(OPEN_LOOP))
            x_m, y_m, heading = 0.0, 0.0, 0.0
            for forward, left, turn in OPEN_LOOP:
                for _ in range(periods):
                    real.drive(forward, left, turn)
                    real.advance()
                    middle = heading + 0.5 * turn * real.period_s
                    x_m += (forward * math.cos(middle) - left * math.sin(middle)) * real.period_s
                    y_m += (forward * math.sin(middle) + left * math.cos(middle)) * real.period_s
                    heading += turn * real.period_s
            real.stand()
            truth = client.get("/mock/truth")
            return round(math.dist((truth["x"], truth["y"]), (x_m, y_m)), 4)
    finally:
        ended(robot, client)
