"""The controller as a process: its event loop, its ROS node and its end."""

from __future__ import annotations

import logging
import os
import signal
from typing import Final

from palaestra_sim.ros import Loop, MasterUnreachable, RosNode
from palaestra_sim.ros_controller.controller import RosController
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.webots.library import Library
from palaestra_sim.webots.options import ControllerOptions
from palaestra_sim.webots.robot import webots_robot
from palaestra_sim.webots.steps import WebotsSteps

log = logging.getLogger(__name__)

_CHECK_MASTER_S: Final = 1.0
_NO_MASTER: Final = 1
_DEFAULT_MASTER: Final = "http://localhost:11311"
# robot_init sets handlers for these signals, which end the process without a word to the ROS master.
_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP)


class ControllerProcess:
    """Serves one robot until Webots, a signal or the ROS master ends it.

    Args:
        library: the library of Webots.
        options: the options of the controller.
    """

    def __init__(self, library: Library, options: ControllerOptions) -> None:
        self._library = library
        self._options = options
        self._loop = Loop()
        self._exit_code = 0

    def run(self) -> int:
        """Serve the robot; return the exit code of the process: 1 if the ROS master does not respond."""
        self._library.robot_init()
        self._loop.wake_on_signals()
        for number in _SIGNALS:
            signal.signal(number, lambda *_: self._loop.post(lambda: self._end(0)))
        master_uri = os.environ.get("ROS_MASTER_URI") or self._options.master_uri or _DEFAULT_MASTER
        node = RosNode(self._loop, self._options.name, master_uri)
        node.on_end(self._shut_down)
        steps = WebotsSteps(self._library, self._loop, lambda: self._end(0))
        robot = webots_robot(self._library, self._options, steps, self._loop.later)
        controller = RosController(robot, node, FrontOptions(), lambda: 0.0)
        try:
            controller.start()
            self._check(node)
            self._loop.run()
        except MasterUnreachable as error:
            log.error("%s", error)
            self._exit_code = _NO_MASTER
        controller.close()
        return self._exit_code

    def _end(self, code: int) -> None:
        self._exit_code = code
        self._loop.stop()

    def _shut_down(self, reason: str) -> None:
        log.warning("the node was shut down (%s); the robot no longer has a controller", reason)
        self._end(0)

    def _check(self, node: RosNode) -> None:
        """End the process if the ROS master does not respond; a restarted master does not know its names."""
        try:
            node.check_master()
        except MasterUnreachable as error:
            log.warning("%s", error)
            self._end(_NO_MASTER)
            return
        self._loop.later(_CHECK_MASTER_S, lambda: self._check(node))
