"""A simulator as a program: its command line, and the lifecycle of its process.

Every simulator that uses `ros_controller` and `scene` is an instance of `Program`, with its own physics.
"""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

from palaestra_protocol.batch import MOST_ROWS
from palaestra_protocol.control import LEFT_OUT_FILE, VIEW_SOCKET
from palaestra_protocol.numbers import milliseconds, whole
from palaestra_sim import faults
from palaestra_sim.errors import SimError, StandInError, WorldError, WorldRefusedError
from palaestra_sim.ros import LocalSocket, Loop, MasterUnreachable, RosNode
from palaestra_sim.ros_controller.backend import Backend
from palaestra_sim.ros_controller.left_out import write_left_out
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.ros_controller.simulator import Load, RunningSimulator
from palaestra_sim.ros_controller.viewing import answers
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.physics import Physics
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.scene.world_report import differences, lacks, silent_devices, summary
from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.mjcf import is_mjcf
from palaestra_sim.world.stand_ins import StandIn, load_stand_ins

log = logging.getLogger(__name__)

_MODES = {"pause": Mode.PAUSE, "realtime": Mode.REAL_TIME, "fast": Mode.FAST}
_CHECK_MASTER_S = 1.0
_ALL = "all"
_WRONG_WORLD = 2
_NO_MASTER = 1

_EPILOG = """\
The program reads the world, and like every ROS node the variables ROS_MASTER_URI and ROS_HOSTNAME. A sidecar
may set two more variables. PALAESTRA_SIMULATOR_LEFT_OUT names a file; in this file the program lists the
nodes that it leaves out. PALAESTRA_SIMULATOR_VIEW names a Unix socket; on this socket the program describes
its world to viewers.

faults: for example crash:step=2000, or lost:topic=ir1/value,probability=0.01. docs/reference/faults.md lists
all faults. PALAESTRA_STUB_FAULTS may hold several faults with spaces between them. Instead of --fault-seed,
you can set PALAESTRA_STUB_FAULT_SEED; instead of --fault-life, you can set PALAESTRA_SIMULATOR_START.

exit codes: 0 after SIGTERM; the status of `simulation_quit`; the code that a fault names;
1 the ROS master does not respond, or has stopped responding; 2 the world or the options cannot be used
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """The program of one simulator.

    Attributes:
        name: the name of the command, such as palaestra-stub.
        description: the description in the program's help.
        physics: returns a new physics object for a world that is about to be loaded.
        mjcf: returns the simulation of an MJCF world; None if the program does not simulate MJCF. The last
            argument of the function is the folder that holds all files of the world. If this argument is
            None, the simulation uses the nearest folder that holds all these files.
        batched: returns a new physics object for a world of `--batch`; None if the program has no `--batch`.
        check_batch: checks that copies of a world can be simulated.
        serve_batch: serves copies of a world until a signal, and returns the exit code.
    """

    name: str
    description: str
    physics: Callable[[], Physics]
    mjcf: Callable[[Path, Mode, LeaveOut, Path | None], Backend] | None = None
    batched: Callable[[], Physics] | None = None
    check_batch: Callable[[Backend, Path], None] | None = None
    serve_batch: Callable[[Backend, Path, int, int], int] | None = None

    def run(self, arguments: Sequence[str] | None = None) -> int:
        """Run the simulator until a client or a signal ends it; return the exit code."""
        options = _parser(self).parse_args(arguments)
        logging.basicConfig(level=logging.INFO, format=f"{self.name}: %(message)s", stream=sys.stderr)
        try:
            return self._check(options) if options.check else self._simulate(options)
        except WorldRefusedError as error:
            # A sidecar reports only the last line of the output, so the summary comes last.
            sys.stderr.write(f"{error}\n{self.name}: {error.summary}\n")
        except SimError as error:
            sys.stderr.write(f"{self.name}: {error}\n")
        except RecursionError:
            fact = "nodes are nested too deep, or one uses itself; use fewer levels"
            sys.stderr.write(f"{self.name}: {options.world}: {fact}\n")
        except MasterUnreachable as error:
            sys.stderr.write(f"{self.name}: {error}\n")
            return _NO_MASTER
        except OSError as error:
            sys.stderr.write(f"{self.name}: {error.filename or 'network'}: {error.strerror}\n")
        return _WRONG_WORLD

    def _check(self, options: argparse.Namespace) -> int:
        """Print the summary of the world; return 0 if the world can be started with these options.

        Without --leave-out, this check leaves out every node that the simulator does not support, so that the
        summary can list all of them.
        """
        chosen = _leave_out(options.leave_out) if options.leave_out else LeaveOut(everything=True)
        load = self._loader(options, replace(chosen, names=True))
        simulation = load(options.world.absolute(), _MODES[options.mode])
        for line in summary(simulation, chosen=bool(options.leave_out)):
            sys.stdout.write(f"{line}\n")
        if self.check_batch is not None and options.batch is not None:
            self.check_batch(self._batched_world(options), options.world)
        return _WRONG_WORLD if lacks(simulation) and not options.leave_out else 0

    def _simulate(self, options: argparse.Namespace) -> int:
        if self.serve_batch is not None and options.batch is not None:
            if faults.read_options(options, os.environ) is not None:
                raise faults.FaultError("--batch: injects no faults; remove --fault, or remove --batch")
            simulation = self._batched_world(options)
            return self.serve_batch(simulation, options.world, options.batch, options.batch_threads)
        return _Process(options, self._loader(options, _leave_out(options.leave_out))).run()

    def _batched_world(self, options: argparse.Namespace) -> Backend:
        """Return the world with the physics of a batch."""
        load = self._loader(options, _leave_out(options.leave_out), self.batched)
        return load(options.world.absolute(), Mode.FAST)

    def _loader(
        self, options: argparse.Namespace, leave_out: LeaveOut, physics: Callable[[], Physics] | None = None
    ) -> Load:
        """Return the function that loads a world; the loader treats a file that begins with `<` as MJCF."""
        wbt = Loader(
            physics=physics or self.physics, stand_ins=_stand_ins(options.stand_ins), leave_out=leave_out
        )

        def load(world_path: Path, mode: Mode) -> Backend:
            if not is_mjcf(read_bounded(world_path)):
                return wbt(world_path, mode)
            if self.mjcf is None:
                raise WorldError(
                    world_path.name,
                    1,
                    1,
                    f"{self.name} cannot load MJCF, and the world is a model of MuJoCo",
                    "use driver mujoco",
                )
            return self.mjcf(world_path, mode, leave_out, options.root)

        return load


class _Process:
    """The process of a simulator: its event loop, its ROS nodes, and the simulation that they serve."""

    def __init__(self, options: argparse.Namespace, load: Load) -> None:
        self._ordered = faults.read_options(options, os.environ)
        self._course = (
            None if self._ordered is None else faults.begin(self._ordered, faults.survey(load, options.world))
        )
        self._loop = Loop()
        self._master_uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
        self._new_node = self._node_maker()
        self._nodes: dict[str, RosNode] = {}
        self._exit_code = 0
        self._simulator = RunningSimulator(
            options.world,
            load,
            self._make_node,
            options=FrontOptions(
                step_sleep_s=options.step_sleep_ms / 1000.0,
                lost_wakeup=options.lost_wakeup,
                publish_delay_s=options.publish_delay_ms / 1000.0,
            ),
            mode=_MODES[options.mode],
        )
        self._simulator.on_quit(self.end)

    def run(self) -> int:
        """Run the simulator until it has to end; return the exit code."""
        self._loop.wake_on_signals()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: self._loop.post(lambda: self.end(0)))
        if self._course is None:
            self._start()
        else:
            self._start_as_ordered(self._course)
        viewing = self._viewing()
        self._loop.run()
        if viewing is not None:
            viewing.close()
        self._simulator.close()
        self._loop.close()
        return self._exit_code

    def end(self, status: int) -> None:
        """Make `run` close everything and return `status`."""
        self._exit_code = status
        self._loop.stop()

    def lose_master(self) -> None:
        """Exit as if the ROS master no longer responded."""
        log.warning("an injected fault: the ROS master at %s counts as lost", self._master_uri)
        for node in self._nodes.values():
            if isinstance(node, faults.FaultyNode):
                node.lose_master()
        self.end(_NO_MASTER)

    def lose_names(self) -> None:
        """Unregister every name at the master, and continue."""
        for name in self._simulator.controllers:
            self._nodes[name].unregister()

    def _start(self) -> None:
        # The report is written first, because a sidecar reads the file as soon as the simulator is ready.
        self._report_left_out()
        self._simulator.start()
        silent = silent_devices(self._simulator.simulation.robots)
        if silent:
            log.warning("devices without readings, whose enable returns failure: %s", silent)
        for difference in differences(self._simulator.simulation):
            log.warning("differs from Webots: %s", difference)
        log.info("%s: %s", self._simulator.world_path.name, ", ".join(self._simulator.controllers))
        self._loop.later(_CHECK_MASTER_S, self._check_master)

    def _viewing(self) -> LocalSocket | None:
        """Return the socket for viewers; None if the environment names none, or if it cannot be created."""
        path = os.environ.get(VIEW_SOCKET)
        if path is None:
            return None
        try:
            return LocalSocket(self._loop, Path(path), answers(self._simulator))
        except OSError as error:
            log.warning("%s: no viewer can connect (%s)", path, error.strerror)
            return None

    def _report_left_out(self) -> None:
        left_out = self._simulator.simulation.left_out
        for each in left_out:
            log.warning("%s", each)
        if left_out and (file := os.environ.get(LEFT_OUT_FILE)):
            write_left_out(left_out, Path(file))

    def _start_as_ordered(self, fault_state: faults.FaultState) -> None:
        """Start with injected faults, which may delay the start or prevent it."""
        log.info("faults: %s", self._ordered)
        refused, delay_s = fault_state.start()
        if refused is None:
            self._loop.later(delay_s, self._start)
        else:
            log.error("fault: %s", refused.text)
            self._loop.later(0.0, lambda: self.end(refused.code))

    def _node_maker(self) -> Callable[[str], RosNode]:
        """Return the function that makes a ROS node: a `RosNode`, or a `FaultyNode` if there are faults."""
        if self._course is None:
            return partial(RosNode, self._loop, master_uri=self._master_uri)
        failing = faults.Failing(course=self._course, effects=faults.ProcessFaults(self))
        return partial(faults.FaultyNode, self._loop, master_uri=self._master_uri, failing=failing)

    def _make_node(self, name: str) -> RosNode:
        node = self._new_node(name)
        node.on_end(lambda reason: self._lose(name, reason))
        self._nodes[name] = node
        return node

    def _lose(self, name: str, reason: str) -> None:
        """Close the controller whose ROS node was shut down; the simulation continues without it."""
        log.warning("the node %s was shut down (%s); its robot no longer has a controller", name, reason)
        controller = self._simulator.controllers.pop(name, None)
        if controller is not None:
            controller.close()

    def _check_master(self) -> None:
        """Exit if the ROS master does not respond.

        A restarted master does not know this simulator's names, so clients could not find the simulator.
        Webots' controller exits in this case too.
        """
        for name in self._simulator.controllers:
            try:
                self._nodes[name].check_master()
            except MasterUnreachable as error:
                log.warning("%s", error)
                self.end(_NO_MASTER)
                return
        self._loop.later(_CHECK_MASTER_S, self._check_master)


def _parser(program: Program) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=program.name,
        description=program.description,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--version", action="version", version=version("palaestra-sim"))
    add("world", type=Path, help="the file to load: .wbt, or .xml for MuJoCo")
    add("--check", action="store_true", help="print a summary of the world and exit")
    add("--mode", choices=_MODES, default="fast", help="simulation mode at the start (default: %(default)s)")
    add("--step-sleep-ms", type=milliseconds, default=0.0, help="minimum real time of each step")
    add("--publish-delay-ms", type=milliseconds, default=0.0, help="delay of the messages after a step")
    add("--lost-wakeup", action="store_true", help="lose the messages of a step that comes too early")
    add(
        "--stand-ins",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a table of PROTOs to simulate as simple solids, in addition to the built-in ones; repeatable",
    )
    add(
        "--leave-out",
        action="append",
        default=[],
        metavar="TYPE",
        help=f"leave out nodes of this type if they cannot be simulated; {_ALL}: of any type; repeatable",
    )
    if program.mjcf is not None:
        add(
            "--root",
            type=Path,
            metavar="DIR",
            help="folder that holds all files that an MJCF model names (default: the nearest such folder)",
        )
    if program.serve_batch is not None:
        add(
            "--batch",
            type=whole(1, MOST_ROWS),
            metavar="N",
            help=f"simulate N copies, at most {MOST_ROWS}, for a trainer, without ROS",
        )
        add(
            "--batch-threads",
            type=whole(0),
            default=0,
            metavar="N",
            help="threads for the copies; 0: one for each processor (default: 0)",
        )
    faults.add_options(add)
    return parser


def _stand_ins(files: Sequence[Path]) -> Mapping[str, StandIn]:
    """Return the stand-ins in these files by name; a later entry replaces an earlier entry of the same name.

    Raises:
        StandInError: a file is not a valid table of stand-ins.
        OSError: a file cannot be read.
    """
    table: dict[str, StandIn] = {}
    for file in files:
        try:
            text = read_bounded(file).decode()
        except UnicodeDecodeError:
            raise StandInError(f"{file}: this is not UTF-8; save it as UTF-8") from None
        table.update(load_stand_ins(text, str(file)))
    return table


def _leave_out(types: Sequence[str]) -> LeaveOut:
    return LeaveOut(types=frozenset(types), everything=_ALL in types)
