"""The floor of a deployment: its places as a person types them, and the fence around start and targets."""

from __future__ import annotations

import math
from collections.abc import Sequence

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.real_robots.safety import Fence
from palaestra_trainer.robots.geometry import Point, Pose

MARGIN_M = 1.0  # without a given fence, the fence is this far around start and targets


def point_of(text: str) -> Point:
    """Return the point `X,Y`.

    Raises:
        ConfigurationError: the text is not two finite numbers.
    """
    x_m, y_m = _numbers(text, "X,Y")
    return x_m, y_m


def pose_of(text: str) -> Pose:
    """Return the pose `X,Y,HEADING`.

    Raises:
        ConfigurationError: the text is not three finite numbers.
    """
    return Pose(*_numbers(text, "X,Y,HEADING"))


def fence_of(text: str) -> Fence:
    """Return the fence `X,Y,X,Y`.

    Raises:
        ConfigurationError: the text is not four finite numbers, or the robot has no place in the rectangle.
    """
    low_x, low_y, high_x, high_y = _numbers(text, "X,Y,X,Y")
    return Fence((low_x, low_y), (high_x, high_y))


def fence_around(start: Pose, targets: Sequence[Point], given: Fence | None) -> Fence:
    """Return the given fence, or else a fence around start and targets.

    Raises:
        ConfigurationError: neither a fence nor a target is given, or a place is too close to the fence.
    """
    if given is None and not targets:
        raise ConfigurationError("fence: neither --target nor --fence is given; give the floor for the robot")
    begin = (start.x_m, start.y_m)
    fence = given or _around([begin, *targets])
    for name, (x_m, y_m) in (("start", begin), *(("target", target) for target in targets)):
        if not fence.admits((x_m, y_m)):
            raise ConfigurationError(
                f"fence: the {name} ({x_m:g}, {y_m:g}) is too close to the fence for the robot; widen --fence"
            )
    return fence


def _around(points: Sequence[Point]) -> Fence:
    xs, ys = zip(*points, strict=True)
    return Fence((min(xs) - MARGIN_M, min(ys) - MARGIN_M), (max(xs) + MARGIN_M, max(ys) + MARGIN_M))


def _numbers(text: str, form: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != len(form.split(",")) or not all(map(math.isfinite, numbers)):
        raise ConfigurationError(f"{text!r} is not {form} in meters and radians")
    return numbers
