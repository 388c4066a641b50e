"""The options of the front."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontOptions:
    """The behavior of controllers in matters in which Webots varies.

    Attributes:
        step_sleep_s: least real time of a `time_step`, to imitate a bigger world.
        lost_wakeup: whether the controller can lose a wake-up, like the real one: if a step is requested
            before the messages of the step before are sent, or within `publish_delay_s` after, its messages
            never come.
        publish_delay_s: from the end of a step to its messages; 0 is right after the answer.
    """

    step_sleep_s: float = 0.0
    lost_wakeup: bool = False
    publish_delay_s: float = 0.0
