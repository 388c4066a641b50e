"""What can be set about a stub, beside its world."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class StubOptions:
    """How a stub behaves where Webots varies.

    Attributes:
        step_sleep_s: real time that every `time_step` takes at least, as a bigger world would.
        lost_wakeup: whether the controller can lose a wake-up, as the real one does: the messages
            of a step that is asked for before those of the step before are out, or within
            `publish_delay_s` after, never come.
        publish_delay_s: from the end of a step to its messages; 0 is right after the answer.
    """

    step_sleep_s: float = 0.0
    lost_wakeup: bool = False
    publish_delay_s: float = 0.0
