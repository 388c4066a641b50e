"""A running simulator: the simulation of a world, and the controllers of its robots.

When a client loads another world, the controllers of the old world end and those of the new world start; the
simulator continues. The module `program` has the command line, the event loop and the signals. That module
gives the simulator ROS nodes and a clock, and ends the process when the simulator calls the callback of
`on_quit`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_controller.backend import Backend
from palaestra_sim.ros_controller.controller import RosController
from palaestra_sim.ros_controller.handles import Handles
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.ros_controller.scene_robot import served
from palaestra_sim.ros_interfaces import NodeInterface
from palaestra_sim.scene.arguments import ControllerArguments
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.stepping import Stepping

MakeNode = Callable[[str], NodeInterface]


Load = Callable[[Path, Mode], Backend]


class RunningSimulator:
    """A simulator; its constructor loads and checks the world, and `start` starts the controllers.

    Args:
        world_path: the world file; each reload reads the file again.
        load: returns the simulation of a world file, which starts in the given mode.
        make_node: returns the ROS node for a name.
        options: the timing of the imitated controllers.
        mode: the simulation mode at the start.
        clock: returns seconds of real time, from any origin.

    Attributes:
        simulation: the simulation of the loaded world.
        controllers: the controllers of robots whose controller is "ros", by ROS name.
        quit_status: the exit status that a client set with `simulation_quit`; None before that call.

    Raises:
        WorldError: the file is wrong, or contains a node that cannot be simulated.
        OSError: the file cannot be read.
    """

    def __init__(
        self,
        world_path: Path,
        load: Load,
        make_node: MakeNode,
        *,
        options: FrontOptions | None = None,
        mode: Mode = Mode.REAL_TIME,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.world_path = world_path.absolute()
        self.options = options or FrontOptions()
        self.clock = clock
        self.controllers: dict[str, RosController] = {}
        self.quit_status: int | None = None
        self._load = load
        self._make_node = make_node
        self._loads = 0
        self._ended: Callable[[int], None] = _ignore
        self._take(*self._read(self.world_path, mode))

    def start(self) -> None:
        """Start the controllers of the robots."""
        self._handles = Handles(self.simulation, self._loads)
        for robot in self._arguments:
            self._start_controller(robot)

    def on_quit(self, callback: Callable[[int], None]) -> None:
        """Set the function that ends the program; its argument is the exit status that a client requested."""
        self._ended = callback

    def arguments(self, robot: Robot) -> ControllerArguments:
        """Return the controllerArgs of a robot whose controller is "ros"."""
        return self._arguments[robot]

    def set_mode(self, mode: Mode) -> None:
        """Set the simulation mode; after a pause, run the steps that waited for its end."""
        self.simulation.mode = mode
        self._stepping.advance()

    def quit(self, status: int) -> None:
        """End the simulator after the response to the current call.

        Pending steps fail; then the callback of `on_quit` is called.
        """
        if self.quit_status is not None:
            return
        self.quit_status = status
        self.simulation.quit(status)
        self._soon(self._end)

    def reload(self) -> None:
        """Load the world file again, after the response to the current call."""
        self.load(str(self.world_path))

    def load(self, path: str) -> bool:
        """Load another world, after the response to the current call; return False if that is impossible.

        All controllers end, and those of the new world start. So services disappear and appear again, and all
        devices are off.
        """
        world_path = Path(path).absolute()
        try:
            loaded = self._read(world_path, self.simulation.mode)
        except (OSError, WorldError):
            return False
        self._soon(lambda: self._exchange(world_path, loaded))
        return True

    def restart(self, robot: Robot) -> None:
        """Restart the controller of one robot, after the response to the current call."""
        if robot in self._arguments:
            self._soon(lambda: self._restart(robot))

    def close(self) -> None:
        """Close all controllers."""
        self._stepping.end()
        for controller in list(self.controllers.values()):
            controller.close()
        self.controllers.clear()

    def _read(self, world_path: Path, mode: Mode) -> tuple[Backend, dict[Robot, ControllerArguments]]:
        """Return the simulation of a world, and the arguments of its robots with a "ros" controller."""
        simulation = self._load(world_path, mode)
        arguments = {robot: robot.parts.arguments for robot in simulation.robots}
        return simulation, {robot: given for robot, given in arguments.items() if given is not None}

    def _take(self, simulation: Backend, arguments: dict[Robot, ControllerArguments]) -> None:
        self.simulation = simulation
        self._arguments = arguments
        self._stepping = Stepping(simulation)

    def _start_controller(self, robot: Robot) -> None:
        node = self._make_node(self._arguments[robot].name)
        served_robot = served(self, self._stepping, self._handles, robot)
        controller = RosController(served_robot, node, self.options, self.clock)
        self.controllers[node.name] = controller
        controller.start()

    def _exchange(self, world_path: Path, loaded: tuple[Backend, dict[Robot, ControllerArguments]]) -> None:
        self.close()
        self.world_path = world_path
        self._loads += 1
        self._take(*loaded)
        self.start()

    def _restart(self, robot: Robot) -> None:
        controller = self.controllers.pop(self._arguments[robot].name, None)
        if controller is not None:
            controller.close()
        self._start_controller(robot)

    def _end(self) -> None:
        self._stepping.end()
        self._ended(self.quit_status or 0)

    def _soon(self, callback: Callable[[], None]) -> None:
        """Call `callback` after the response to the current call was sent."""
        next(iter(self.controllers.values())).node.later(0.0, callback)


def _ignore(_status: int) -> None:
    """Do nothing at the end; `on_quit` replaces this function."""
