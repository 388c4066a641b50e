"""The command-line options of `palaestra-sidecar`."""

import argparse
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NoReturn

from palaestra_protocol.http import Address
from palaestra_protocol.numbers import whole
from palaestra_sim.sidecar.drivers import Driver
from palaestra_sim.sidecar.world_files import located

EXIT_WRONG = 2
OWN_CONTROLLER, STOCK_CONTROLLER = "palaestra", "webots"
# A job sets this variable, because it has no field for `--webots-controller`.
CONTROLLER = "WEBOTS_ROS_CONTROLLER"

EPILOG = """
This program does not start the simulator by itself. A client starts it with POST /start on the control port;
see palaestra_protocol.control. The simulator inherits the environment, with ROS_MASTER_URI and ROS_HOSTNAME.

reads   the world
writes  with --job a copy of the world with other ROS names, GROUP-INDEX.wbt, to the folder of --work; for
        Webots the copy is in a project, with links to the controllers and PROTOs around the world, and the
        project `webots` in that folder has the controller ros
prints  first the two addresses; then its own lines, which begin with "palaestra-sidecar: ", and the lines of
        the simulator
serves  control: /start /ready /stop /state; health: /healthz /state /metrics; both: /scene /watch /camera

With --standby the sidecar has a second simulator, slot b, which can start while the first one works. Slot b
has its own world (GROUP-INDEXb.wbt), ROS names, process and paths (/standby/start and so on). Output lines
begin with "a: " or "b: ". The variable PALAESTRA_SIMULATOR_SLOT holds the slot of a simulator.

With --work, PALAESTRA_SIMULATOR_LEFT_OUT names a file. Before the simulator is ready, it may list in this
file the nodes that it leaves out of the world: one line for each kind of node. /state returns these lines.

exit codes: 0 after SIGTERM or SIGINT, if all processes ended; 1 if a process hung and still runs;
            2 wrong options or world, a port in use, a missing program: no simulator was started
"""


class _Parser(argparse.ArgumentParser):
    """Prints a usage error in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_WRONG, f"{self.prog}: {message}; see --help\n")


def parse(arguments: Sequence[str], environment: Mapping[str, str] = os.environ) -> argparse.Namespace:
    """Return the options; if an option or the variable of an option is wrong, exit with code 2."""
    parser = _Parser(
        prog="palaestra-sidecar",
        description="Start, watch and stop one simulator at its trainer's command.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    _add_simulator(parser, environment)
    _add_listeners(parser)
    _add_identity(parser)
    options = parser.parse_args(arguments)
    if options.webots_controller not in {OWN_CONTROLLER, STOCK_CONTROLLER}:
        parser.error(
            f"{CONTROLLER}: {options.webots_controller!r} is not a controller; "
            f"set {OWN_CONTROLLER} or {STOCK_CONTROLLER}"
        )
    return options


def _add_simulator(parser: argparse.ArgumentParser, environment: Mapping[str, str]) -> None:
    group = parser.add_argument_group("the simulator")
    group.add_argument("--driver", choices=[driver.value for driver in Driver], required=True)
    group.add_argument(
        "--world", type=located, required=True, metavar="WORLD", help="a file, or the name of a shipped world"
    )
    group.add_argument(
        "--root",
        type=Path,
        metavar="DIR",
        help="a folder above the world that holds all its files; default: the nearest, or its Webots project",
    )
    group.add_argument(
        "--option", action="append", default=[], metavar="X", help="option for the simulator; repeatable"
    )
    group.add_argument(
        "--webots-controller",
        choices=(OWN_CONTROLLER, STOCK_CONTROLLER),
        default=environment.get(CONTROLLER, OWN_CONTROLLER),
        help="for driver webots, the controller `ros`: of Palaestra, or of Webots up to R2023b "
        f"(default: {CONTROLLER}, or {OWN_CONTROLLER})",
    )
    group.add_argument(
        "program", nargs="*", help="for driver command, after --; {world} stands for the world's path"
    )


def _add_listeners(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("listeners (port 0: any free port)")
    group.add_argument("--control", type=_address, default="127.0.0.1:7100", metavar="HOST:PORT")
    group.add_argument("--health", type=_address, default="0.0.0.0:7200", metavar="HOST:PORT")
    group.add_argument(
        "--allow-remote-control",
        action="store_true",
        help="allow a control address other than loopback; only in a network that others cannot reach",
    )
    group.add_argument("--until-stdin-closes", action="store_true", help="exit also when stdin closes")
    group.add_argument(
        "--until-silent",
        type=whole(1),
        metavar="SECONDS",
        help="exit also after this many seconds without a request to the control port",
    )


def _add_identity(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("ROS names (without --job the world runs unchanged)")
    group.add_argument("--job", metavar="NAME")
    group.add_argument("--namespace", default="default", metavar="NAME")
    group.add_argument("--uid", default="", metavar="UID")
    group.add_argument("--replica", type=whole(), default=0, metavar="N")
    group.add_argument("--group", default="collect", metavar="NAME")
    group.add_argument("--index", type=whole(), default=0, metavar="N")
    group.add_argument("--work", type=Path, metavar="DIR", help="folder for the generated world")
    group.add_argument(
        "--clock", action="store_true", help="let this simulator publish /clock; only one for each ROS master"
    )
    group.add_argument(
        "--suffix",
        default="",
        metavar="TEXT",
        help="without --job: text to append to the world's names; without --work the copy is temporary",
    )
    group.add_argument("--standby", action="store_true", help="add a second simulator as a standby")


def _address(text: str) -> Address:
    try:
        return Address.parse(text)
    except ValueError as error:
        # argparse prints the message of an ArgumentTypeError, but not the message of a ValueError.
        raise argparse.ArgumentTypeError(str(error)) from error
