"""The program `palaestra-mock-robot`."""

from __future__ import annotations

import argparse
import logging
import math
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from importlib.metadata import version
from random import Random
from typing import Final

from palaestra_protocol.http import Address
from palaestra_protocol.numbers import milliseconds, seconds, whole
from palaestra_protocol.signals import obeyed, set_at_signals
from palaestra_sim.errors import SimError
from palaestra_sim.mock_robot.driver import Limits
from palaestra_sim.mock_robot.pace import MOST_BEHIND_S, Clock, PaceThread
from palaestra_sim.mock_robot.rest import PoorNetwork, routes
from palaestra_sim.mock_robot.robot import Habits, MockRobot, MockRobotError
from palaestra_sim.mock_robot.ros1 import Ros1Driver
from palaestra_sim.mock_robot.server import RestServer
from palaestra_sim.sidecar.world_files import located

_NAME: Final = "palaestra-mock-robot"
_WRONG: Final = 2
_PARENT_CHECK_S: Final = 0.25
_MASTER_URI: Final = "http://localhost:11311"

_EPILOG = """\
prints  one line, http://HOST:PORT, when the robot is ready
serves  /data/...: the REST interface of a Robotino; the robot stops 200 ms after the last command
        /cam0: a test picture with a red pole at the origin of the world; it needs palaestra-sim[pictures]
        GET /mock/truth: the true pose and motion; POST /mock/place [X, Y, HEADING]: carry the robot;
        POST /mock/charger {"connected": true}: connect the charger
--ros1  registers the node robotino_node at the ROS master of ROS_MASTER_URI, as a Robotino's driver does: it
        subscribes to cmd_vel, and publishes odom, distance_sensors and bumper

Robot time is real time times --speed. The 200 ms and all delays are robot time.
The mock has no authentication, like the robot. So listen on a loopback address, or in a network of your own.

exit codes: 0 after SIGTERM or SIGINT, or if the parent process has ended (but not under nohup);
            2 wrong options or world, or a port in use
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the mock robot until a signal ends it; return the exit code."""
    parent = os.getppid()
    options = _parser().parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format=f"{_NAME}: %(message)s", stream=sys.stderr)
    ending = threading.Event()
    try:
        robot = _robot(options)
        clock = Clock(options.speed, robot.time_s, max(MOST_BEHIND_S, robot.step_ms / 1000.0))
        with ExitStack() as stack:
            server = stack.enter_context(_server(options, robot, clock))
            set_at_signals(ending, obeyed((signal.SIGTERM, signal.SIGINT)))
            pace = PaceThread(robot, clock)
            pace.start()
            stack.callback(pace.stop)
            if options.ros1:
                stack.callback(_driver(options, robot, clock, ending).close)
            sys.stdout.write(f"http://{server.address}\n")
            sys.stdout.flush()
            _wait(ending, parent)
    except SimError as error:
        sys.stderr.write(f"{_NAME}: {error}\n")
        return _WRONG
    return 0


def _wait(ending: threading.Event, parent: int) -> None:
    """Return at a signal; unless nohup started the program, also when the parent process has ended."""
    outlives = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    while not ending.wait(_PARENT_CHECK_S):
        if os.getppid() != parent and not outlives:
            return


def _robot(options: argparse.Namespace) -> MockRobot:
    """Return the robot at its start pose.

    Raises:
        SimError: the world or the start pose is wrong.
    """
    world = located(options.world)
    try:
        habits = Habits(drift=options.drift, noise_m=options.noise, seed=options.seed)
        robot = MockRobot(world, habits)
    except OSError as error:
        remedy = "give a .wbt file, or the name of a shipped world, such as arena"
        raise MockRobotError(f"WORLD: {options.world}: {error.strerror}; {remedy}") from error
    robot.charging = options.charging
    if options.start is not None:
        try:
            robot.place(*options.start)
        except MockRobotError as error:
            raise MockRobotError(f"--start: {error}") from error
    return robot


def _server(options: argparse.Namespace, robot: MockRobot, clock: Clock) -> RestServer:
    """Return the server, which listens on its port.

    Raises:
        SimError: the address is in use, or does not belong to this machine.
    """
    random = Random(options.seed)
    network = PoorNetwork(clock, options.delay_ms, options.timeouts, random)
    try:
        return RestServer(options.listen, routes(robot, clock), network.wait_s)
    except OSError as error:
        fact = f"--listen: {options.listen}: {error.strerror}"
        raise MockRobotError(f"{fact}; choose another address or port") from error


def _driver(
    options: argparse.Namespace, robot: MockRobot, clock: Clock, ending: threading.Event
) -> Ros1Driver:
    """Return the driver for ROS 1, which is registered at the master.

    Raises:
        SimError: no ROS master responds.
    """
    master_uri = os.environ.get("ROS_MASTER_URI", _MASTER_URI)
    namespace = os.environ.get("ROS_NAMESPACE", "")
    limits = Limits(max_linear_vel=options.max_speed)
    driver = Ros1Driver(robot, clock, limits, master_uri, namespace)
    driver.node.on_end(lambda _reason: ending.set())
    return driver


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_NAME,
        description="Serve the network interface of a Robotino for a simulated robot.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--version", action="version", version=version("palaestra-sim"))
    add("world", nargs="?", default="arena", help="a .wbt file or a shipped world (default: %(default)s)")
    add(
        "--listen",
        type=_address,
        default="127.0.0.1:8080",
        metavar="HOST:PORT",
        help="(default: %(default)s)",
    )
    add("--speed", type=seconds, default=1.0, help="seconds of robot time for each second (default: 1)")
    add(
        "--start",
        type=_pose,
        metavar="X,Y,HEADING",
        help="pose at the start in m and rad, such as --start=-1,0.5,3.14 (default: the pose in the world)",
    )
    add(
        "--drift",
        type=_number(1.0),
        default=0.02,
        help="size of the errors of the odometry, as a share (default: %(default)s)",
    )
    add(
        "--noise",
        type=_number(1.0),
        default=0.0,
        metavar="M",
        help="standard deviation of the distances, in m",
    )
    add("--delay-ms", type=milliseconds, default=0.0, metavar="MS", help="delay of every response")
    add(
        "--timeouts",
        type=_number(1.0),
        default=0.0,
        metavar="P",
        help="share of responses that come 1 s late",
    )
    add("--seed", type=whole(), default=0, help="seed of all random numbers (default: %(default)s)")
    add("--charging", action="store_true", help="start with the charger connected")
    add("--ros1", action="store_true", help="run the robot's driver for ROS 1 too")
    add(
        "--max-speed",
        type=seconds,
        default=Limits().max_linear_vel,
        metavar="M/S",
        help="with --ros1: the driver's parameter max_linear_vel (default: %(default)s)",
    )
    return parser


def _address(text: str) -> Address:
    try:
        return Address.parse(text)
    except ValueError as error:
        # argparse prints the message of an ArgumentTypeError, but not the message of a ValueError.
        raise argparse.ArgumentTypeError(str(error)) from error


def _pose(text: str) -> tuple[float, float, float]:
    try:
        x, y, heading = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a pose; give three numbers as X,Y,HEADING"
        ) from None
    if not all(map(math.isfinite, (x, y, heading))):
        raise argparse.ArgumentTypeError(f"{text!r} is not finite; give three finite numbers")
    return x, y, heading


def _number(most: float) -> Callable[[str], float]:
    """Return a parser of numbers from 0 to `most`, for argparse's `type`."""

    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
        if not 0.0 <= number <= most:
            raise argparse.ArgumentTypeError(f"{text} is refused; give 0 to {most:g}")
        return number

    return read
