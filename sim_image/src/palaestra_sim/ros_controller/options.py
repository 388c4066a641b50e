"""The options of `ros_controller`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontOptions:
    """Options that imitate the timing of Webots' controller; this timing differs between worlds and machines.

    Attributes:
        step_sleep_s: minimum real time of a `time_step` in seconds, to imitate a larger world.
        lost_wakeup: whether the controller can lose the messages of a step, as Webots' controller can. The
            messages are lost if the step is requested before the messages of the previous step are sent, or
            within `publish_delay_s` after that.
        publish_delay_s: delay in seconds from the end of a step to the messages of this step; 0 means right
            after the response.
    """

    step_sleep_s: float = 0.0
    lost_wakeup: bool = False
    publish_delay_s: float = 0.0
