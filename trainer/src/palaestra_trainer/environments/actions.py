"""Convert an action of a policy into a velocity of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from palaestra_trainer.environments.options import Driving
from palaestra_trainer.robots.geometry import SPEED_M_S, TURN_RAD_S, Movement, Twist

SCALE = (SPEED_M_S, SPEED_M_S, TURN_RAD_S)  # velocities for a continuous action of 1, 1, 1


def action_space(options: Driving) -> spaces.Space[Any]:
    """Return `Discrete(n)` for n movements, or a `Box` of shape (3,) within [-1, 1]."""
    if options.actions == "continuous":
        return spaces.Box(-1.0, 1.0, (len(SCALE),), np.float32)
    return spaces.Discrete(len(options.movements))


def twist(action: Any, options: Driving) -> Twist:
    """Return the velocity for an action of `action_space(options)`, as `Omnidrive.drive` takes it."""
    if options.actions == "continuous":
        return _scaled(action)
    return options.movements[int(action)].twist


def nearest(wanted: Twist, options: Driving) -> Any:
    """Return the action whose velocity is nearest to the wanted velocity."""
    if options.actions == "continuous":
        return np.clip(np.divide(wanted, SCALE), -1.0, 1.0).astype(np.float32)
    return _nearest(wanted, options.movements)


def _scaled(action: NDArray[np.float32]) -> Twist:
    forward, left, turning = np.clip(action, -1.0, 1.0).tolist()
    return forward * SCALE[0], left * SCALE[1], turning * SCALE[2]


def _nearest(wanted: Twist, movements: Sequence[Movement]) -> int:
    errors = [np.abs(np.subtract(movement.twist, wanted)).sum() for movement in movements]
    return int(np.argmin(errors))
