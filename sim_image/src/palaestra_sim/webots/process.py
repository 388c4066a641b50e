"""The controller as a process: its event loop, its ROS node and its end."""

from __future__ import annotations

import logging
import os
import signal
import time
from typing import Final

from palaestra_sim import faults
from palaestra_sim.ros import Loop, MasterUnreachable, RosNode
from palaestra_sim.ros_controller.controller import RosController
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.ros_controller.served_robot import ServedRobot
from palaestra_sim.webots.library import Library
from palaestra_sim.webots.options import ControllerOptions
from palaestra_sim.webots.robot import webots_robot
from palaestra_sim.webots.steps import WebotsSteps

log = logging.getLogger(__name__)

_CHECK_MASTER_S: Final = 1.0
_NO_MASTER: Final = 1
_DEFAULT_MASTER: Final = "http://localhost:11311"
# The handlers that robot_init sets for these signals end the process without a message to the ROS master.
_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP)


class ControllerProcess:
    """Serves one robot until Webots, a signal, the ROS master or an injected fault ends it.

    Args:
        library: the library of Webots, after `robot_init`.
        options: the options of the controller.
        ordered: the injected faults; None without faults.
    """

    def __init__(
        self, library: Library, options: ControllerOptions, ordered: faults.Ordered | None = None
    ) -> None:
        self._library = library
        self._options = options
        self._ordered = ordered
        self._loop = Loop()
        self._exit_code = 0
        self._nodes: list[RosNode] = []

    def run(self) -> int:
        """Serve the robot; return the exit code of the process: 1 if the ROS master does not respond.

        Raises:
            FaultError: an injected fault names a path that the robot does not have.
        """
        self._loop.wake_on_signals()
        for number in _SIGNALS:
            signal.signal(number, lambda *_: self._loop.post(lambda: self.end(0)))
        steps = WebotsSteps(self._library, self._loop, lambda: self.end(0))
        robot = webots_robot(self._library, self._options, steps, self._loop.later)
        course = None if self._ordered is None else self._begin(self._ordered, robot)
        refused, delay_s = (None, 0.0) if course is None else course.start()
        if refused is not None:
            log.error("fault: %s", refused.text)
            return refused.code
        time.sleep(delay_s)  # only an injected fault delays the start; no client waits yet
        return self._serve(robot, self._make_node(course))

    def end(self, status: int) -> None:
        """Make `run` close the connections and return `status`."""
        self._exit_code = status
        self._loop.stop()

    def lose_master(self) -> None:
        """End as if the ROS master no longer responded."""
        for node in self._nodes:
            if isinstance(node, faults.FaultyNode):
                node.lose_master()
        self.end(_NO_MASTER)

    def lose_names(self) -> None:
        """Unregister every name at the master, and continue."""
        for node in self._nodes:
            node.unregister()

    def _begin(self, ordered: faults.Ordered, robot: ServedRobot) -> faults.FaultState:
        log.info("faults: %s", ordered)
        return faults.begin(ordered, faults.survey_robot(robot, self._options.name))

    def _make_node(self, course: faults.FaultState | None) -> RosNode:
        name = self._options.name
        master_uri = os.environ.get("ROS_MASTER_URI") or self._options.master_uri or _DEFAULT_MASTER
        if course is None:
            node = RosNode(self._loop, name, master_uri)
        else:
            failing = faults.Failing(course=course, effects=faults.ProcessFaults(self))
            node = faults.FaultyNode(self._loop, name, master_uri, failing)
        node.on_end(self._shut_down)
        self._nodes.append(node)
        return node

    def _serve(self, robot: ServedRobot, node: RosNode) -> int:
        controller = RosController(robot, node, FrontOptions(), time.monotonic)
        try:
            controller.start()
            self._check(node)
            self._loop.run()
        except MasterUnreachable as error:
            log.error("%s", error)
            self._exit_code = _NO_MASTER
        controller.close()
        return self._exit_code

    def _shut_down(self, reason: str) -> None:
        log.warning("the node was shut down (%s); the robot no longer has a controller", reason)
        self.end(0)

    def _check(self, node: RosNode) -> None:
        """End the process if the ROS master does not respond; a restarted master has lost its names."""
        try:
            node.check_master()
        except MasterUnreachable as error:
            log.warning("%s", error)
            self.end(_NO_MASTER)
            return
        self._loop.later(_CHECK_MASTER_S, lambda: self._check(node))
