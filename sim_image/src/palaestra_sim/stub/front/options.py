"""The options of a stub, besides its world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from palaestra_sim.stub.scene.reading import LeaveOut
from palaestra_sim.world.stand_ins import StandIn


@dataclass(frozen=True, slots=True, kw_only=True)
class StubOptions:
    """The behavior of a stub in matters in which Webots varies.

    Attributes:
        step_sleep_s: least real time of a `time_step`, to imitate a bigger world.
        lost_wakeup: whether the controller can lose a wake-up, like the real one: if a step is requested
            before the messages of the step before are sent, or within `publish_delay_s` after, its messages
            never come.
        publish_delay_s: from the end of a step to its messages; 0 is right after the answer.
        stand_ins: the user's own simple solids in place of PROTOs, by name.
        leave_out: what the user leaves out, if it cannot be simulated.
    """

    step_sleep_s: float = 0.0
    lost_wakeup: bool = False
    publish_delay_s: float = 0.0
    stand_ins: Mapping[str, StandIn] = field(default_factory=dict)
    leave_out: LeaveOut = field(default_factory=LeaveOut)
