"""The `ros` controller of one robot: its services, its steps, and the messages that it sends after each step.

Webots' controller has a main loop in a thread that polls. This module imitates the behavior of that
controller:

- A `time_step` of 0 or of a positive multiple of the basic step is accepted; any other value is refused.
  While a step is pending, the robot is `blocked` and other services wait: Webots holds a mutex that all
  services need.
- After the response to a step, the controller sends one message for each enabled sensor that is due. A sensor
  is due if (count * step) % period is 0. Subscribers that are connected when the message is sent get the
  message.
- `count` is the number of steps. It increases before a step runs. `step` is the value of the last accepted
  `time_step`. So if a client changes the value of `time_step`, `count * step` is not the elapsed time, and
  sensors with longer periods are due at other times than before.

With the option `lost_wakeup`, a step may be requested while the main loop still handles the previous step.
The new step then runs and gets a response, but its messages are lost. Without the option, the controller
sends the messages of the previous step first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from palaestra_sim.ros.node import LATER
from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.ros_controller.served_robot import ServedDevice, ServedRobot
from palaestra_sim.ros_controller.services.devices import Outlet, services_below, stream_outlet
from palaestra_sim.ros_controller.services.logs import NodeLog
from palaestra_sim.ros_interfaces import NodeInterface, PublisherInterface, Service, UnsimulatedError
from palaestra_sim.scene.mode import Mode

_MODEL_NAME = "/model_name"
_CLOCK = "/clock"


class RosController:
    """The controller of one robot, from `start` to `close`.

    Args:
        robot: the robot to serve.
        node: the ROS node whose services and topics the controller uses.
        options: the timing to imitate.
        clock: returns seconds of real time, from any origin.

    Attributes:
        blocked: whether a step is pending; then all other requests have to wait.
    """

    def __init__(
        self, robot: ServedRobot, node: NodeInterface, options: FrontOptions, clock: Callable[[], float]
    ) -> None:
        self.node = node
        self.blocked = False
        self._robot = robot
        self._options = options
        self._host_clock = clock
        self._steps = robot.steps
        self._world = robot.world
        self._outlets = {it: _outlet(node, it) for it in (*robot.devices, *robot.inputs) if it.topics}
        self._streams = tuple(
            stream_outlet(node, device.path, stream) for device in robot.devices for stream in device.streams
        )
        self._feeds = tuple(
            feed for outlet in (*self._outlets.values(), *self._streams) for feed in outlet.feeds
        )
        self._log = NodeLog(node)
        self._clock: PublisherInterface | None = None
        self._basic_ms = robot.basic_step_ms
        self._step_ms = self._basic_ms  # the step of the last accepted time_step
        self._count = 0
        self._call: object | None = None
        self._answer: Any = None
        self._asking = False  # whether `_time_step` has not returned yet
        self._heard = True  # whether the main loop noticed the last step; see `lost_wakeup`
        self._publish_due = False
        self._published_s = -math.inf
        self._paced_until_s = -math.inf
        self._asked_ms = 0
        self._closed = False

    def start(self) -> None:
        """Advertise all services and topics; `robot/get_device_list` comes last."""
        self.node.blocked = lambda: self.blocked
        with self.node.together():
            self._advertise()
        if self._robot.synchronized:
            self._steps.join()

    def _advertise(self) -> None:
        node = self.node
        self._log.open()
        self._serve(*self._log.table())
        model_name = node.advertise(_MODEL_NAME, "std_msgs/String", latched=True)
        model_name.send({"data": node.name})
        if self._robot.clock:
            self._clock = node.advertise(_CLOCK, "rosgraph_msgs/Clock")
        self._serve(Service("robot/time_step", "webots_ros/set_int", self._time_step))
        self._serve(*self._robot.services)
        self._serve_devices()
        if self._robot.auto_publish:
            self._enable_all()
        self._serve(self._robot.device_list)

    def pictures(self) -> Iterator[tuple[str, tuple[int, int], bytes | memoryview]]:
        """Yield the name, the size and the newest picture of each camera that has sent a picture.

        The size is width and height in pixels. A pixel has four bytes: blue, green, red, alpha.
        """
        for device, outlet in self._outlets.items():
            image = outlet.feeds[0]
            if device.camera and image.newest is not None:
                size = (image.constants["width"], image.constants["height"])
                yield device.camera, size, image.newest

    def close(self) -> None:
        """Stop waiting for this robot in steps, and remove its services and topics from ROS."""
        self._closed = True
        self._publish_due = False
        self._steps.leave()
        self.node.close()

    def publish(self) -> None:
        """Send the messages of the last step, unless they were sent already."""
        if not self._publish_due:
            return
        self._publish_due = False
        if self._clock is not None:
            seconds, rest_ms = divmod(self._world.time_ms, 1000)
            self._clock.send({"clock": {"secs": seconds, "nsecs": rest_ms * 1_000_000}})
        elapsed_ms = self._count * self._step_ms
        for feed in self._feeds:
            if feed.publishers:
                feed.publish(elapsed_ms)
        if self._options.lost_wakeup:
            self._published_s = self._host_clock()

    def _enable_all(self) -> None:
        """Enable every device; if a device cannot be enabled, log the reason."""
        for device in self._robot.devices:
            outlet = self._outlets.get(device)
            if outlet is None:
                continue
            try:
                outlet.enable(self._basic_ms, self._basic_ms)
            except UnsimulatedError as error:
                self._log.error(f"{device.path}/enable: {error}")

    def _serve(self, *services: Service) -> None:
        for path, type_name, handler in services:
            self.node.serve(path, type_name, self._log.reporting(path, handler))

    def _serve_devices(self) -> None:
        for device in (*self._robot.devices, *self._robot.inputs):
            self._serve(*services_below(device.path, device.rows))
            self._serve(*services_below(f"palaestra/{device.path}", device.own_rows))
            if device in self._outlets:
                self._serve_outlet(self._outlets[device])
        for outlet in self._streams:
            self._serve_outlet(outlet)

    def _serve_outlet(self, outlet: Outlet) -> None:
        self._serve(*outlet.services(lambda: self._step_ms, self._log.warning))

    def _time_step(self, request: Any) -> Any:
        step_ms = request.value
        if step_ms < 0 or step_ms % self._basic_ms:
            return {"success": False}
        self._heard = self._loop_hears()
        self._count = self._count + 1 if step_ms else 0
        self._call = self.node.current_call
        self._answer = LATER
        self.blocked = self._asking = True
        self._asked_ms = step_ms or self._basic_ms
        self._steps.ask(self._asked_ms, self._stepped)
        self._step_ms = step_ms or self._step_ms
        self._asking = False
        return self._answer

    def _loop_hears(self) -> bool:
        """Return whether the main loop will notice the new step, and so will send its messages.

        With `lost_wakeup`, the main loop does not notice a step while it sends the messages of the last step.
        """
        if not self._options.lost_wakeup:
            self.publish()
            return True
        busy = self._host_clock() - self._published_s < self._options.publish_delay_s
        return not (self._publish_due or busy)

    def _stepped(self, done: bool) -> None:  # noqa: FBT001 - the caller `Steps` passes it by position
        """Respond to a step that has ended, but not before its minimum real time has passed."""
        delay_s = self._delay_s() if done else 0.0
        if delay_s > 0.0:
            self.node.later(delay_s, lambda: self._finish(done))
        else:
            self._finish(done)

    def _finish(self, done: bool) -> None:  # noqa: FBT001 - the caller `_stepped` passes it by position
        self.blocked = False
        self._publish_due = self._publish_due or (done and self._heard)
        if self._publish_due:
            self.node.later(self._options.publish_delay_s, self.publish)
        if self._asking:
            self._answer = {"success": done}
        elif not self._closed:
            self.node.answer(self._call, {"success": done})

    def _delay_s(self) -> float:
        """Return the real time in seconds for which the response to the step has to wait."""
        delay_s = self._options.step_sleep_s
        if self._world.mode is Mode.REAL_TIME:
            now_s = self._host_clock()
            # After a long pause of the client, the simulation may catch up by only one basic step.
            owed_s = now_s - self._basic_ms / 1000.0
            self._paced_until_s = max(self._paced_until_s, owed_s) + self._asked_ms / 1000.0
            delay_s = max(delay_s, self._paced_until_s - now_s)
        return delay_s


def _outlet(node: NodeInterface, device: ServedDevice) -> Outlet:
    return Outlet(node, device.path, device.topics, device.accepts, device.enabled, device.prefix)
