"""A node of ROS 2 with a context and a thread of its own.

Other modules import rclpy and the packages of messages only through `require`, because they are optional.
"""

from __future__ import annotations

import importlib
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final

from palaestra_trainer.errors import ConfigurationError

_END_S: Final = 2.0


def require(module: str) -> Any:
    """Return a module of ROS 2, such as `rclpy` or `nav_msgs.msg`.

    Raises:
        ConfigurationError: the module is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"{error.name} is not installed; source the setup file of your ROS 2, and use its Python"
        ) from error


class Ros2Node:
    """A node of ROS 2, whose callbacks run one after another in a thread of its own.

    rclpy does not handle SIGINT and SIGTERM, so the program's own signal handlers stay in place.

    Args:
        name: the name of the node, unless the arguments rename it.
        namespace: its namespace, such as `/robot1`; None: the namespace in the arguments, or `/`.
        arguments: the arguments of ROS, from `--ros-args` on.

    Attributes:
        ros: the node of rclpy.

    Raises:
        ConfigurationError: rclpy is not installed, or an argument or the namespace is wrong.
    """

    def __init__(self, name: str, namespace: str | None = None, arguments: Sequence[str] = ()) -> None:
        rclpy = require("rclpy")
        signals = require("rclpy.signals")
        executors = require("rclpy.executors")
        self._context = rclpy.Context()
        try:
            rclpy.init(
                args=list(arguments),
                context=self._context,
                signal_handler_options=signals.SignalHandlerOptions.NO,
            )
            self.ros = rclpy.create_node(name, context=self._context, namespace=namespace)
        except Exception as error:  # rclpy raises classes of its own, without a common base
            self._context.try_shutdown()
            raise ConfigurationError(f"ROS 2 refuses the node or its arguments: {error}") from error
        self._executor = executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.ros)
        self._ended = executors.ExternalShutdownException
        self._thread = threading.Thread(target=self._spin, name=f"ros2-{name}", daemon=True)

    def start(self) -> None:
        """Begin to call callbacks; further calls have no effect."""
        if self._thread.ident is None:
            self._thread.start()

    def close(self) -> None:
        """End the thread, the node and its context; further calls have no effect."""
        if not self._context.ok():
            return
        self._executor.shutdown(timeout_sec=_END_S)
        if self._thread.ident is not None:
            self._thread.join(_END_S)
        self.ros.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        """Call callbacks until `close`; if a callback fails, no more readings arrive, so all become old."""
        with suppress(self._ended):
            self._executor.spin()
