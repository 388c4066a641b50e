"""Recordings of evaluation episodes, seen from above; their size is bounded even for long episodes."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import Any

from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.simulators.interface import Located

MOST_FRAMES = 500
MOST_OBSTACLES = 200
MOST_FILMS = 200  # an evaluation records only its first episodes; the poses of a film take at most 6 kB


@dataclass(frozen=True, slots=True, kw_only=True)
class Film:
    """One recorded episode.

    Attributes:
        poses: x, y and heading of all frames in one array; the first frame shows the state after the reset.
        targets: pairs of a frame's number and the position of the target from that frame on.
        frame_s: seconds of simulated time between two frames.
        first: the state after the reset, with the floor and the size of the robot.
    """

    poses: array[float]
    targets: tuple[tuple[int, Point], ...]
    frame_s: float
    first: Sight

    def to_json(self) -> dict[str, Any]:
        """Return the film as JSON data, rounded to a millimeter and a milliradian."""
        floor = self.first.floor
        frames = range(0, len(self.poses), 3)
        film: dict[str, Any] = {
            "frame_s": round(self.frame_s, 6),
            "radius_m": round(self.first.radius_m, 3),
            "poses": [_rounded(*self.poses[frame : frame + 3]) for frame in frames],
            "targets": [[frame, *_rounded(*target)] for frame, target in self.targets],
        }
        if floor is not None:
            standing = [each for each in floor.obstacles if each.standing][:MOST_OBSTACLES]
            film |= {
                "low": _rounded(*floor.low),
                "high": _rounded(*floor.high),
                "obstacles": [
                    _rounded(each.x_m, each.y_m, *each.half_m, each.radius_m, each.heading_rad)
                    for each in standing
                ],
            }
        return film


class Filming:
    """Records one episode of a member; of a long episode only every second, fourth, ... step.

    Args:
        member: the member; if it is None or lacks the interface `Located`, the film stays empty.
    """

    def __init__(self, member: object) -> None:
        self._member = member if isinstance(member, Located) else None
        self._poses = array("f")
        self._targets: list[tuple[int, Point]] = []
        self._first: Sight | None = None
        self._every, self._steps = 1, 0

    def look(self) -> None:
        """Record the current state; call this method after the reset and after each step."""
        sight = self._member.sight() if self._member and self._steps % self._every == 0 else None
        self._steps += 1
        if sight is None:
            return
        self._first = self._first or sight
        if sight.target is not None and (not self._targets or self._targets[-1][1] != sight.target):
            self._targets.append((len(self._poses) // 3, sight.target))
        self._poses.extend(_numbers(sight.pose))
        if len(self._poses) == 3 * MOST_FRAMES:
            self._drop_every_second()

    def film(self) -> Film | None:
        """Return the recording so far; None if it has no frames."""
        if self._first is None:
            return None
        return Film(
            poses=self._poses,
            targets=tuple(self._targets[-MOST_FRAMES:]),
            frame_s=self._every * self._first.period_s,
            first=self._first,
        )

    def _drop_every_second(self) -> None:
        frames = range(0, len(self._poses), 6)
        self._poses = array("f", (number for frame in frames for number in self._poses[frame : frame + 3]))
        self._targets = [((frame + 1) // 2, target) for frame, target in self._targets]
        self._every *= 2


def _numbers(pose: Pose) -> tuple[float, float, float]:
    return pose.x_m, pose.y_m, pose.heading_rad


def _rounded(*numbers: float) -> list[float]:
    return [round(number, 3) for number in numbers]
