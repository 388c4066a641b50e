"""The command line of the sidecar.

The program checks the options and the world, opens the two ports, logs their addresses, and runs the
simulators.
"""

import argparse
import ipaddress
import logging
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from palaestra_protocol.control import BATCH_FILE, LEFT_OUT_FILE, VIEW_SOCKET, SidecarState, SimulatorState
from palaestra_protocol.temporary_folder import temporary_folder
from palaestra_sim.errors import SidecarError, SimError
from palaestra_sim.sidecar import metrics, process, project, signals, world_files
from palaestra_sim.sidecar.drivers import SHOWN, Driver, Launch, command, webots_port
from palaestra_sim.sidecar.last_request import LastRequest
from palaestra_sim.sidecar.options import EXIT_WRONG, OWN_CONTROLLER, parse
from palaestra_sim.sidecar.output import LineHandler
from palaestra_sim.sidecar.server import bound, control_routes, health_routes
from palaestra_sim.sidecar.simulator import SupervisedSimulator
from palaestra_sim.sidecar.viewing import Viewing
from palaestra_sim.webots_project import extra_projects, write_project
from palaestra_sim.world import RunIdentity

log = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the sidecar until SIGTERM or SIGINT, which `entry` has blocked; return its exit code."""
    log_to_stdout()
    given = parse(sys.argv[1:] if arguments is None else arguments)
    with work_folder(given):
        return look_after(given)


@contextmanager
def work_folder(given: argparse.Namespace) -> Iterator[None]:
    """Set `given.work` to a temporary folder for the block, if a folder is needed and --work is not given.

    The generated world of --suffix needs a folder, and so do the socket for viewers and the controller for
    Webots. The sidecar makes the folder itself: a parent process that is killed could not remove the folder.
    """
    needed = given.suffix or Driver(given.driver) in SHOWN or _has_own_controller(given)
    if not needed or given.job is not None or given.work is not None:
        yield
        return
    with temporary_folder("palaestra-world-") as folder:
        process.spare(folder.keeper)
        given.work = folder.path
        yield


def look_after(given: argparse.Namespace) -> int:
    """Run the simulators until a signal requests the end; return the exit code."""
    try:
        simulators = prepare(given)
        missing = _missing_controllers(given)
        requests = LastRequest()
        control = bound("--control", given.control, requests.noted(control_routes(simulators)))
        health = bound("--health", given.health, health_routes(simulators, metrics.registry(simulators)))
    except SimError as error:
        sys.stderr.write(f"palaestra-sidecar: {error}\n")
        return EXIT_WRONG
    signals.take(lambda: shut_down(simulators))
    control.start()
    health.start()
    if given.until_stdin_closes:
        threading.Thread(target=end_with_stdin, daemon=True).start()
    if given.until_silent:
        threading.Thread(target=end_in_silence, args=(requests, given.until_silent), daemon=True).start()
    log.info("control=%s health=%s", control.address, health.address)
    if missing:
        log.warning("warning: %s", missing)
    run(simulators)
    return 0


def shut_down(simulators: Sequence[SupervisedSimulator]) -> None:
    """End all simulators at the same time and make `run` return; safe to call from any thread."""
    for simulator in simulators:
        simulator.shut_down()


def run(simulators: Sequence[SupervisedSimulator]) -> None:
    """Run all simulators, each in its own thread; return when a shutdown has ended all of them."""
    first, *others = simulators
    threads = [threading.Thread(target=other.run, name="simulator", daemon=True) for other in others]
    for thread in threads:
        thread.start()
    first.run()
    for thread in threads:
        thread.join()


def prepare(given: argparse.Namespace) -> tuple[SupervisedSimulator, ...]:
    """Return the simulators, which are not started yet: one, or two with --standby.

    Raises:
        SimError: an option, the world or the program is wrong.
    """
    if not (given.allow_remote_control or ipaddress.ip_address(given.control.host).is_loopback):
        raise SidecarError(
            f"--control: {given.control} is not a loopback address; use 127.0.0.1 or [::1], "
            "or add --allow-remote-control"
        )
    driver = Driver(given.driver)
    if given.program and driver is not Driver.COMMAND:
        raise SidecarError(
            f"--driver {driver}: does not take a program; remove the program, or use --driver command"
        )
    if given.standby and given.job is None:
        raise SidecarError("--standby: two simulators need different ROS names; give --job and --work")
    slots = world_files.SLOTS if given.standby else world_files.SLOTS[:1]
    return tuple(_simulator(given, driver, slot) for slot in slots)


def _simulator(given: argparse.Namespace, driver: Driver, slot: str) -> SupervisedSimulator:
    """Return the simulator of one slot."""
    world = _world(given, slot)
    robots = world_files.described(world_files.read(world), str(world))
    unchanged = world == Path(given.world).absolute()
    root = given.root if unchanged else world_files.root_of_model(given.world, given.root)
    launch = Launch(world=world, root=root, options=_options(given, driver, world), program=given.program)
    left_out = _left_out(given, world)
    own = {"PALAESTRA_SIMULATOR_SLOT": slot} | ({LEFT_OUT_FILE: str(left_out)} if left_out else {})
    view = _view_socket(given, driver, world)
    own |= {VIEW_SOCKET: str(view)} if view else {}
    own |= _controller_project(given) if _has_own_controller(given) else {}
    batch = _batch_file(given, driver, world)
    own |= {BATCH_FILE: str(batch)} if batch else {}
    started = command(driver, launch, os.environ | own)
    return SupervisedSimulator(
        replace(started, mark=f"{slot}: ") if given.standby else started,
        SimulatorState(state=SidecarState.IDLE, driver=driver.value, world=str(world), robots=robots),
        left_out,
        Viewing.without(_nothing_to_see(driver)) if view is None else Viewing(view),
        batch,
    )


def end_with_stdin() -> None:
    """Send SIGTERM to this process when standard input closes, which means that the parent has ended."""
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def end_in_silence(requests: LastRequest, limit_s: float) -> None:
    """Send SIGTERM to this process after `limit_s` seconds without a request to the control port."""
    requests.wait_for_silence(limit_s)
    log.warning("ends: no request to the control port for %g s", limit_s)
    os.kill(os.getpid(), signal.SIGTERM)


def log_to_stdout() -> None:
    """Write the log to standard output, to which the simulator's output goes too."""
    logging.basicConfig(level=logging.INFO, handlers=[LineHandler()])


def _world(given: argparse.Namespace, slot: str) -> Path:
    """Return the world to run: the given world, or, with --job or --suffix, a copy with other ROS names."""
    if given.job is None and not given.suffix:
        return Path(given.world).absolute()
    if given.work is None:
        raise SidecarError(
            "--work: is missing, but required with --job; give the folder for the generated world"
        )
    work, as_project = given.work.absolute(), Driver(given.driver) is Driver.WEBOTS
    if given.job is None:
        return world_files.renamed(given.world, work, given.suffix, as_project=as_project, root=given.root)
    identity = RunIdentity(
        job=given.job,
        namespace=given.namespace,
        uid=given.uid,
        replica=given.replica,
        group=given.group,
        index=given.index,
        slot=slot,
    )
    clock = given.clock and slot == world_files.SLOTS[0]
    return world_files.named(given.world, work, identity, clock=clock, as_project=as_project, root=given.root)


def _has_own_controller(given: argparse.Namespace) -> bool:
    """Return whether Webots uses the controller of Palaestra for robots whose controller is "ros"."""
    return Driver(given.driver) is Driver.WEBOTS and given.webots_controller == OWN_CONTROLLER


def _controller_project(given: argparse.Namespace) -> dict[str, str]:
    """Write the project with our controller into the work folder; return the variable that names it.

    Raises:
        SidecarError: the folder cannot be written.
    """
    folder = Path(given.work).absolute() / "webots"
    try:
        write_project(folder)
    except OSError as error:
        raise SidecarError(
            f"--work: {folder}: {error.strerror}; give a writable folder with space"
        ) from error
    return extra_projects(folder, os.environ)


def _options(given: argparse.Namespace, driver: Driver, world: Path) -> list[str]:
    """Return the options for the simulator; each Webots of a job gets a port of its own.

    The containers of a pod share their ports. Webots uses the port also in the paths of camera images.
    """
    if (
        driver is not Driver.WEBOTS
        or given.job is None
        or any(it.startswith("--port") for it in given.option)
    ):
        return list(given.option)
    return [*given.option, f"--port={webots_port(world.stem)}"]


def _left_out(given: argparse.Namespace, world: Path) -> Path | None:
    """Return the file for the simulator's report on the nodes that it leaves out.

    Return None if the simulator's world is not in the work folder.
    """
    if given.work is None or world == Path(given.world).absolute():
        return None
    return Path(given.work).absolute() / f"{world.stem}.left-out"


def _view_socket(given: argparse.Namespace, driver: Driver, world: Path) -> Path | None:
    """Return the path of the socket on which the simulator describes its world.

    Return None if this driver does not describe its world, or if there is no work folder.
    """
    if given.work is None or driver not in SHOWN:
        return None
    return Path(given.work).absolute() / f"{world.stem}.view"


def _batch_file(given: argparse.Namespace, driver: Driver, world: Path) -> Path | None:
    """Return the file with the address of MuJoCo's copies of the world; None without copies."""
    if given.work is None or driver is not Driver.MUJOCO:
        return None
    return Path(given.work).absolute() / f"{world.stem}.batch"


def _nothing_to_see(driver: Driver) -> str:
    if driver in SHOWN:
        return "this sidecar has no folder for the socket of viewers; give it --work"
    return f"driver {driver} does not describe its world to viewers; use driver {' or '.join(SHOWN)}"


def _missing_controllers(given: argparse.Namespace) -> str | None:
    """Return a warning about controllers that Webots cannot find; None for other simulators."""
    if Driver(given.driver) is not Driver.WEBOTS:
        return None
    return project.missing_controllers(given.world, world_files.read(given.world), os.environ)
