"""Find the rows whose robot cannot touch anything for some milliseconds, for any commands of its motors.

These rows are stepped with a model without shapes. A row counts as free only if, seen from above, a circle
around its robot does not meet the outline of any obstacle. The circle has the size of the robot plus the
longest way that the robot's servos allow.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.body import LARGEST_ACCELERATIONS
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.model import Built

_SPARE_M: Final = 1e-3
_UPRIGHT: Final = 1.0 - 1e-9
_PLANE: Final = int(mujoco.mjtGeom.mjGEOM_PLANE)
_BOX: Final = int(mujoco.mjtGeom.mjGEOM_BOX)
_ROUND: Final = (int(mujoco.mjtGeom.mjGEOM_CYLINDER), int(mujoco.mjtGeom.mjGEOM_CAPSULE))


class Clearance:
    """The outlines of the obstacles of a world with one robot, seen from above.

    Each outline is a rectangle with rounded corners: a box, a circle, or the circle around any other shape.

    Args:
        built: the model with its current state; the obstacles never move.
    """

    def __init__(self, built: Built) -> None:
        model, data = built.model, built.data
        mujoco.mj_kinematics(model, data)
        own = np.flatnonzero(built.of_robots)
        others = [geom for geom in range(model.ngeom) if _may_touch(model, geom, own)]
        self._shut = any(model.geom_type[geom] == _PLANE for geom in others)
        outlines = np.array([_outline(model, data, geom) for geom in others]).reshape(len(others), 7)
        self._x, self._y, self._c, self._s, self._half_x, self._half_y, self._round = outlines.T
        reach_m = max((_reach(model, geom) for geom in own.tolist()), default=0.0)
        self._round = self._round + reach_m + _SPARE_M
        self._acceleration = math.hypot(*LARGEST_ACCELERATIONS[:2])

    def free(self, positions: Any, speeds: Any, duration_s: float) -> Any:
        """Return for each row whether its robot touches nothing for `duration_s` seconds.

        Args:
            positions: x, y and heading of the robots (rows, 3).
            speeds: vx, vy and omega of the robots (rows, 3).
            duration_s: at most a basic step, in which the target speeds do not change.
        """
        if self._shut:
            return np.zeros(len(positions), dtype=bool)
        way = (np.hypot(speeds[:, 0], speeds[:, 1]) + self._acceleration * duration_s) * duration_s
        dx, dy = positions[:, :1] - self._x, positions[:, 1:2] - self._y
        beyond_x = np.maximum(np.abs(dx * self._c + dy * self._s) - self._half_x, 0.0)
        beyond_y = np.maximum(np.abs(dy * self._c - dx * self._s) - self._half_y, 0.0)
        gaps = np.sqrt(beyond_x * beyond_x + beyond_y * beyond_y) - self._round
        return gaps.min(axis=1, initial=np.inf) > way


def _may_touch(model: Any, geom: int, own: Any) -> bool:
    if geom in own:
        return False
    meets = (model.geom_contype[own] & model.geom_conaffinity[geom]) | (
        model.geom_conaffinity[own] & model.geom_contype[geom]
    )
    return bool(meets.any())


def _outline(model: Any, data: Any, geom: int) -> tuple[float, ...]:
    """Return x, y, cosine and sine of the heading, half the size, and the rounding of an outline."""
    turn = data.geom_xmat[geom].reshape(3, 3)
    x, y, _ = data.geom_xpos[geom].tolist()
    upright = abs(turn[2, 2]) > _UPRIGHT
    size = model.geom_size[geom].tolist()
    if upright and model.geom_type[geom] == _BOX:
        return x, y, float(turn[0, 0]), float(turn[1, 0]), size[0], size[1], 0.0
    if upright and model.geom_type[geom] in _ROUND:
        return x, y, 1.0, 0.0, 0.0, 0.0, size[0]
    return x, y, 1.0, 0.0, 0.0, 0.0, float(model.geom_rbound[geom])


def _reach(model: Any, geom: int) -> float:
    """Return the greatest distance in meters of a part of the robot from the robot's axis."""
    x, y, _ = model.geom_pos[geom].tolist()
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, model.geom_quat[geom])
    turn = flat.reshape(3, 3)
    if abs(turn[2, 2]) > _UPRIGHT and model.geom_type[geom] in _ROUND:
        return math.hypot(x, y) + float(model.geom_size[geom][0])
    center, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
    corners = [turn @ (center + half * signs) for signs in itertools.product((-1.0, 1.0), repeat=3)]
    return max(math.hypot(x + corner[0], y + corner[1]) for corner in corners)
