"""`palaestra-deploy` drives a real Robotino with a policy package."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from palaestra_protocol.imports import import_without

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.numbers import seconds
from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run, write_line
from palaestra_trainer.errors import ConfigurationError, RobotStopped, TrainerError
from palaestra_trainer.real_robots.deployment import floor
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.safety import SafetyRules
from palaestra_trainer.real_robots.sensor_layout import ORDERS, UNITS, SensorLayout
from palaestra_trainer.real_robots.topics import topics_of
from palaestra_trainer.run.signals import Interruption
from palaestra_trainer.run.telemetry.logs import configure_logs

if TYPE_CHECKING:
    from palaestra_trainer.real_robots.deployment.deploy import Deployment
    from palaestra_trainer.real_robots.deployment.terminal import Terminal

DEPLOY = """\
Drive a real Robotino with a policy package.

reads:
  PACKAGE, a folder or a zip of `palaestra export RUN --to package`; every file is checked before the robot
  moves
writes:
  a record of poses, readings, commands and decisions as a ROS 2 bag, by default deployment-<time>.mcap

First, the program shows the commands of the policy for live readings, and sends no command to the robot.
After you confirm, the robot drives while you hold a key. Before you drive, read the page
docs/howto/real-robot.md, and have the robot's emergency stop in reach: this program is not a safety function.
"""
EXIT_CODES = """\
exit codes:
  0    every episode ended as a success, or the task reports no success; or only a dry run was asked for
  1    an episode ended without success, and no further episode was started; or any other error
  2    the package, the robot or an option is wrong; the robot has not moved
  3    a safety rule stopped the robot, or the person did not confirm
  130  ended by Ctrl-C; the robot was commanded to stand
"""
STOPPED = 3

Typed = TypeVar("Typed")


def deploy(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-deploy`; return its exit code."""
    options = arguments_parser().parse_args(_joined(sys.argv[1:] if arguments is None else arguments))
    configure_logs()
    try:
        with Interruption() as interruption:
            return _drive(options, interruption)
    except RobotStopped as error:
        refuse_without_run(error)
        return STOPPED
    except (TrainerError, OSError) as error:
        return refuse_without_run(error)


def _drive(options: argparse.Namespace, interruption: Interruption) -> int:
    from palaestra_trainer.real_robots.command_loop import Hooks
    from palaestra_trainer.real_robots.connect import link_to
    from palaestra_trainer.real_robots.deployment import checked_package
    from palaestra_trainer.real_robots.deployment.deploy import Deployment
    from palaestra_trainer.real_robots.deployment.hold_key import HoldKey
    from palaestra_trainer.real_robots.deployment.record import DeploymentRecord
    from palaestra_trainer.real_robots.deployment.terminal import Terminal
    from palaestra_trainer.real_robots.robotino import RealRobotino

    package = checked_package.read(options.package)
    rules = _rules(options)
    terminal = Terminal(None if options.no_hold or options.dry_run else HoldKey())
    clock = RobotClock(options.mock_speed)
    sensors = SensorLayout(order=options.sensor_order, unit=options.sensor_unit)
    link = link_to(options.robot, sensors, clock, topics_of(options.topic))
    path = options.log or Path(time.strftime("deployment-%Y%m%d-%H%M%S.mcap"))
    record = DeploymentRecord(path, {"package": str(options.package), "robot": options.robot})
    with ExitStack() as stack:
        hooks = Hooks(permitted=terminal.permits, decided=record.decided, check=interruption.check)
        robot = RealRobotino(link, rules, package.period_s, clock, hooks)
        stack.enter_context(robot)
        robot.connect(muted=True)
        stack.enter_context(record)
        stack.callback(robot.close)  # runs before the record is closed, so the record contains the stop
        robot.stand_at(options.start)
        deployment = Deployment(package, robot, record, terminal.show)
        targets: list[tuple[float, float] | None] = list(options.target) or [None]
        deployment.rehearse(targets[0])
        terminal.end_line()
        if options.dry_run:
            return ExitCode.DONE
        if not options.yes and not terminal.confirms(options.robot, interruption.check):
            return STOPPED
        stack.enter_context(terminal.holding())
        stack.callback(robot.close)  # runs before the terminal is restored, because restoring it may block
        robot.unmute()
        return _drive_all(deployment, targets, terminal)


def _drive_all(
    deployment: Deployment, targets: Sequence[tuple[float, float] | None], terminal: Terminal
) -> int:
    """Drive the episodes; end after the first without success, because the robot may then touch an object."""
    for target in targets:
        end = deployment.drive(target)
        terminal.end_line()
        write_line(f"{end.outcome} after {end.steps} steps")
        if end.success is False:
            return 1
    return ExitCode.DONE


def _rules(options: argparse.Namespace) -> SafetyRules:
    fence = floor.fence_around(options.start, options.target, options.fence)
    return SafetyRules(speed_m_s=options.speed_limit, turn_rad_s=options.turn_limit, fence=fence)


def arguments_parser() -> argparse.ArgumentParser:
    """Return the parser of the program's arguments."""
    options = parser("palaestra-deploy", DEPLOY, EXIT_CODES)
    add, limits = options.add_argument, SafetyRules()
    add("package", type=Path, metavar="PACKAGE", help="folder or zip of the package")
    add("--robot", required=True, metavar="ADDRESS", help=_ROBOT)
    add("--target", type=_typed(floor.point_of), action="append", default=[], metavar="X,Y", help=_TARGET)
    add("--start", type=_typed(floor.pose_of), default="0,0,0", metavar="X,Y,HEADING", help=_START)
    add("--fence", type=_typed(floor.fence_of), metavar="X,Y,X,Y", help=_FENCE)
    add(
        "--speed-limit",
        type=seconds,
        default=limits.speed_m_s,
        metavar="M/S",
        help="default: %(default)s",
    )
    add(
        "--turn-limit",
        type=seconds,
        default=limits.turn_rad_s,
        metavar="RAD/S",
        help="default: %(default)s",
    )
    add("--dry-run", action="store_true", help="show the commands of some steps, and do not drive")
    add("--yes", action="store_true", help="do not ask before driving")
    add(
        "--no-hold",
        action="store_true",
        help=_NO_HOLD,
    )
    add("--sensor-order", choices=ORDERS, default=ORDERS[0], help="order of the robot's distance sensors")
    add("--sensor-unit", choices=UNITS, default=UNITS[0], help="unit of the robot's distance sensors")
    add("--topic", action="append", default=[], metavar="NAME=TOPIC", help=_TOPIC)
    add("--log", type=Path, metavar="FILE", help="the record; default: deployment-<time>.mcap")
    add("--mock-speed", type=seconds, default=1.0, metavar="N", help="speed of a mock robot, times real time")
    return options


_ROBOT = "http://HOST of the robot, ros1://HOST:PORT[/NAMESPACE] of its ROS master, or ros2:[/NAMESPACE]"
_TARGET = "target of an episode in m; repeatable: each further episode begins where the last one ended"
_START = "where the robot stands, in m and rad of the task's frame (default: 0,0,0)"
_FENCE = "least x and y, then greatest, in m: the robot stays inside (default: 1 m around start and targets)"
_TOPIC = "over ROS: topic in place of the driver's, such as odom=/robot/odom; repeatable"
_NO_HOLD = "drive without a held key; use it only if the robot cannot hit a person"
_NEGATIVE = ("--target", "--start", "--fence")


def _joined(arguments: Sequence[str]) -> list[str]:
    """Join options with their values, because argparse takes a value such as -1,0 for an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and joined[-1] in _NEGATIVE:
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def _typed(read: Callable[[str], Typed]) -> Callable[[str], Typed]:
    """Return a `type` for argparse, which then reports an error of `read` with the option's name."""

    def value(text: str) -> Typed:
        try:
            return read(text)
        except ConfigurationError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return value


def deploy_and_leave() -> int:
    """Run `palaestra-deploy`; before the process ends, the robot has been commanded to stand."""
    return leaving(deploy)


if __name__ == "__main__":
    sys.exit(deploy_and_leave())
