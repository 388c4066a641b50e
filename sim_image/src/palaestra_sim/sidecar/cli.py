"""The command line of the sidecar: check everything, listen, say where, then own the simulator."""

import argparse
import ipaddress
import logging
import os
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn

from palaestra_sim.errors import SimError
from palaestra_sim.protocol.control import SidecarState, SimulatorState
from palaestra_sim.sidecar import metrics, preparation
from palaestra_sim.sidecar.drivers import Driver, Launch, command
from palaestra_sim.sidecar.errors import SidecarError
from palaestra_sim.sidecar.keeper import adopt_orphans
from palaestra_sim.sidecar.output import LineHandler
from palaestra_sim.sidecar.process import Command, reap
from palaestra_sim.sidecar.server import Address, Listener, control_routes, health_routes
from palaestra_sim.sidecar.simulator import Simulator
from palaestra_sim.world import RunIdentity

SHUTDOWN_S = 1.8  # when this has passed after a SIGTERM the sidecar ends, whatever hangs
EXIT_WRONG = 2
EXIT_HUNG = 1

EPILOG = """
The simulator is not started by this program's start but by POST /start on the control port; see
palaestra_sim.protocol.control. It gets this program's environment, so ROS_MASTER_URI and ROS_HOSTNAME.

reads   the world; with --job it writes the world with its own ROS names, GROUP-INDEX.wbt, to --work
prints  first the two addresses; then its own lines, as "palaestra-sidecar: ...", and the simulator's
serves  control: /start /ready /stop /state; health: /healthz /state /metrics

exit codes: 0 after SIGTERM or SIGINT, with nothing left running; 1 the same, but something hung;
            2 wrong options or world, a port in use, a missing program: nothing was started
"""

log = logging.getLogger(__name__)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_WRONG, f"{self.prog}: {message}; see --help\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the sidecar until SIGTERM or SIGINT; return its exit code."""
    log_to_stdout()
    given = parse(sys.argv[1:] if arguments is None else arguments)
    try:
        simulator_command, state = prepare(given)
        control = Listener("--control", given.control)
        health = Listener("--health", given.health)
    except SimError as error:
        sys.stderr.write(f"palaestra-sidecar: {error}\n")
        return EXIT_WRONG
    simulator = Simulator(simulator_command, state)
    end_on_signals(simulator)
    reap_always()
    control.serve(control_routes(simulator))
    health.serve(health_routes(simulator, metrics.registry(simulator)))
    if given.until_stdin_closes:
        threading.Thread(target=end_with_stdin, daemon=True).start()
    log.info("control=%s health=%s", control.address, health.address)
    simulator.run()
    return 0


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options; ends the program with code 2 when they are wrong."""
    parser = _Parser(
        prog="palaestra-sidecar",
        description="Start, watch and stop one simulator, as its trainer commands.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    simulator = parser.add_argument_group("the simulator")
    simulator.add_argument("--driver", choices=[driver.value for driver in Driver], required=True)
    simulator.add_argument(
        "--world", type=preparation.located, required=True, metavar="WORLD", help="a file, or one that ships"
    )
    simulator.add_argument(
        "--option", action="append", default=[], metavar="X", help="for the simulator; repeatable"
    )
    simulator.add_argument(
        "program", nargs="*", help="for driver command, behind --; {world} stands for the world's path"
    )
    listeners = parser.add_argument_group("listeners (port 0: any that is free)")
    listeners.add_argument("--control", type=_address, default="127.0.0.1:7100", metavar="HOST:PORT")
    listeners.add_argument("--health", type=_address, default="0.0.0.0:7200", metavar="HOST:PORT")
    listeners.add_argument(
        "--until-stdin-closes", action="store_true", help="end too when standard input does"
    )
    identity = parser.add_argument_group("ROS names (without --job the world runs as it is)")
    identity.add_argument("--job", metavar="NAME")
    identity.add_argument("--namespace", default="default", metavar="NAME")
    identity.add_argument("--uid", default="", metavar="UID")
    identity.add_argument("--replica", type=int, default=0, metavar="N")
    identity.add_argument("--group", default="collect", metavar="NAME")
    identity.add_argument("--index", type=int, default=0, metavar="N")
    identity.add_argument("--work", type=Path, metavar="DIR", help="where the named world is written")
    identity.add_argument(
        "--clock", action="store_true", help="this simulator may publish /clock; one per ROS master"
    )
    return parser.parse_args(arguments)


def prepare(given: argparse.Namespace) -> tuple[Command, SimulatorState]:
    """Return how the simulator is started, and what is known of it before.

    Raises:
        SimError: an option, the world or the program is wrong.
    """
    if not ipaddress.ip_address(given.control.host).is_loopback:
        raise SidecarError(f"--control: {given.control} is not on loopback, and anyone could use it")
    driver = Driver(given.driver)
    if given.program and driver is not Driver.COMMAND:
        raise SidecarError(f"--driver {driver}: takes no program; use --driver command")
    world = _world(given)
    robots = preparation.described(preparation.read(world), str(world))
    launch = Launch(world=world, options=given.option, program=given.program)
    state = SimulatorState(state=SidecarState.IDLE, driver=driver.value, world=str(world), robots=robots)
    return command(driver, launch, os.environ), state


def end_on_signals(simulator: Simulator) -> None:
    """End on SIGTERM and SIGINT, also as process 1, which gets no signal that it doesn't ask for."""

    def shut_down(_number: int, _frame: FrameType | None) -> None:
        if not signal.getitimer(signal.ITIMER_REAL)[0]:  # the first signal counts
            signal.setitimer(signal.ITIMER_REAL, SHUTDOWN_S)
        simulator.shut_down()

    signal.signal(signal.SIGTERM, shut_down)
    signal.signal(signal.SIGINT, shut_down)
    # The keeper sees the end of its pipe, and ends the rest.
    signal.signal(signal.SIGALRM, lambda *_: os._exit(EXIT_HUNG))


def reap_always() -> None:
    """Leave no zombie, also as process 1, which gets the orphans of the whole container."""
    adopt_orphans()
    signal.signal(signal.SIGCHLD, lambda *_: reap())


def end_with_stdin() -> None:
    """End, as by SIGTERM, when standard input does: whoever held its other end is gone."""
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def log_to_stdout() -> None:
    """Send the log where the simulator's output goes."""
    logging.basicConfig(level=logging.INFO, handlers=[LineHandler()])


def _address(text: str) -> Address:
    try:
        return Address.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error  # argparse drops other messages


def _world(given: argparse.Namespace) -> Path:
    """Return the world to run: the given one, or with --job its copy with its own ROS names."""
    if given.job is None:
        return Path(given.world).absolute()
    if given.work is None:
        raise SidecarError("--work: is missing; with --job, give the folder for the generated world")
    identity = RunIdentity(
        job=given.job,
        namespace=given.namespace,
        uid=given.uid,
        replica=given.replica,
        group=given.group,
        index=given.index,
    )
    return preparation.named(given.world, given.work.absolute(), identity, clock=given.clock)


if __name__ == "__main__":
    sys.exit(main())
