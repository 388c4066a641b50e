"""Convert the ranges of a Lidar to a scan."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def scan_of(ranges: NDArray[np.float32], within: tuple[float, float]) -> NDArray[np.float32]:
    """Return the first layer of a Lidar's ranges, clipped to `within` and counter-clockwise from the right.

    A Lidar orders its rays from left to right. The range of a ray without a hit is infinite.
    """
    scan: NDArray[np.float32] = np.clip(ranges[0, ::-1], *within).astype(np.float32)
    return scan
