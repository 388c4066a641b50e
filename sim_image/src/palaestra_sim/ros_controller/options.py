"""The options of `ros_controller`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontOptions:
    """The behavior of controllers where that of Webots varies.

    Attributes:
        step_sleep_s: minimum real time of a `time_step`, to imitate a bigger world.
        lost_wakeup: whether the controller can lose a wake-up, as the real one does. If a step is requested
            before the messages of the previous step are sent, or within `publish_delay_s` after that, its
            messages are lost.
        publish_delay_s: delay from the end of a step to its messages; 0 means right after the response.
    """

    step_sleep_s: float = 0.0
    lost_wakeup: bool = False
    publish_delay_s: float = 0.0
