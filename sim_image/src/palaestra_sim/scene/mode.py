"""The simulation mode: whether the simulation runs, and how fast."""

from __future__ import annotations

from enum import IntEnum


class Mode(IntEnum):
    """The modes of the simulator, with the numbers of `simulation_set_mode` in R2021a and later."""

    PAUSE = 0
    REAL_TIME = 1
    FAST = 2
