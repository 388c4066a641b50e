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

from palaestra_sim.errors import SimError
from palaestra_sim.protocol.control import SidecarState, SimulatorState
from palaestra_sim.sidecar import metrics, preparation, signals
from palaestra_sim.sidecar.drivers import Driver, Launch, command
from palaestra_sim.sidecar.errors import SidecarError
from palaestra_sim.sidecar.options import EXIT_WRONG, parse
from palaestra_sim.sidecar.output import LineHandler
from palaestra_sim.sidecar.process import Command
from palaestra_sim.sidecar.server import Listener, control_routes, health_routes
from palaestra_sim.sidecar.simulator import Simulator
from palaestra_sim.world import RunIdentity

log = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the sidecar until SIGTERM or SIGINT; return its exit code."""
    signals.hold_back()
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
    signals.take(simulator.shut_down)
    control.serve(control_routes(simulator))
    health.serve(health_routes(simulator, metrics.registry(simulator)))
    if given.until_stdin_closes:
        threading.Thread(target=end_with_stdin, daemon=True).start()
    log.info("control=%s health=%s", control.address, health.address)
    simulator.run()
    return 0


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


def end_with_stdin() -> None:
    """End, as by SIGTERM, when standard input does: whoever held its other end is gone."""
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def log_to_stdout() -> None:
    """Send the log where the simulator's output goes."""
    logging.basicConfig(level=logging.INFO, handlers=[LineHandler()])


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
