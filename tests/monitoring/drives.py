"""Draw the episodes of a trained policy from above: `python -m tests.monitoring.drives RUN`.

docs/images/drives.gif    six episodes that were not used in training, in the included simulator, accelerated
"""

import io
import math
import sys
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from PIL import Image

from palaestra_trainer import load_policy
from palaestra_trainer.environments.move_to_target import REACHED_M
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.layout import FloorLayout
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.simulators.connect import OwnSimulator
from palaestra_trainer.simulators.entry_point import make
from tests.local_run import ROOT

PICTURE = ROOT / "docs/images/drives.gif"
SEEDS = range(1000, 1006)
SIDE_IN, DPI = 3.6, 100
WALL_M = 0.06
FASTER = 3.0
LAST_MS = 1500
COLORS = 32  # enough for flat areas; more colors make the file larger


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """One episode: its first sight, the poses after the reset and after each step, and its success."""

    first: Sight
    poses: list[Pose]
    reached: bool


def main(run: str) -> int:
    """Draw episodes of the policy in a run directory."""
    drives = _drives(run)
    steps = max(len(drive.poses) for drive in drives)
    frames = [_frame(drives, step) for step in range(steps)]
    _write(frames, 1000 * drives[0].first.period_s / FASTER, PICTURE)
    return 0


def _drives(run: str) -> list[Drive]:
    """Return an episode for each seed."""
    policy = load_policy(run)
    with closing(OwnSimulator()) as simulator:
        env = make(simulator.robot, simulator.scene, **policy.environment_options)
        return [_drive(policy, env, simulator.scene, seed) for seed in SEEDS]


def _drive(policy: Any, env: Any, scene: Any, seed: int) -> Drive:
    observation, info = env.reset(seed=seed)
    first, ended = scene.sight(), False
    poses = [first.pose]
    while not ended:
        action, _ = policy.predict(observation)
        observation, _, terminated, truncated, info = env.step(action)
        poses.append(scene.sight().pose)
        ended = terminated or truncated
    return Drive(first=first, poses=poses, reached=info["is_success"])


def _frame(drives: list[Drive], step: int) -> Image.Image:
    """Return the picture after `step` steps; an episode that has ended stays at its last pose."""
    with mpl.rc_context({"font.size": 8}):
        figure = Figure(figsize=(SIDE_IN, SIDE_IN), dpi=DPI, layout="tight")
        axes = figure.add_subplot()
        _draw_floor(axes, drives[0].first.floor)
        for number, drive in enumerate(drives):
            _draw_drive(axes, drive, step, f"C{number}")
        arrived = sum(drive.reached and step >= len(drive.poses) - 1 for drive in drives)
        axes.set_title(f"{arrived} of {len(drives)} targets reached", loc="left", weight="bold")
        FigureCanvasAgg(figure)
        content = io.BytesIO()
        figure.savefig(content, format="png")
    return Image.open(content).convert("RGB").quantize(COLORS)


def _draw_floor(axes: Axes, floor: FloorLayout) -> None:
    (left, bottom), (right, top) = floor.low, floor.high
    axes.add_patch(Rectangle((left, bottom), right - left, top - bottom, color="0.97"))
    for it in floor.obstacles:
        if not it.standing:
            continue
        if it.half_m == (0.0, 0.0):
            axes.add_patch(Circle((it.x_m, it.y_m), it.radius_m, color="0.55"))
        else:
            corner, size = (it.x_m - it.half_m[0], it.y_m - it.half_m[1]), [2 * half for half in it.half_m]
            turned = {"angle": math.degrees(it.heading_rad), "rotation_point": "center"}
            axes.add_patch(Rectangle(corner, *size, color="0.55", **turned))
    axes.set(xlim=(left - WALL_M, right + WALL_M), ylim=(bottom - WALL_M, top + WALL_M), aspect="equal")
    axes.set_axis_off()


def _draw_drive(axes: Axes, drive: Drive, step: int, color: str) -> None:
    """Draw the target as a ring, the path so far as a line, and the robot with its heading."""
    seen = drive.poses[: step + 1]
    x_m, y_m, heading = seen[-1].x_m, seen[-1].y_m, seen[-1].heading_rad
    radius = drive.first.radius_m
    axes.add_patch(Circle(drive.first.target, REACHED_M, fill=False, color=color, linewidth=1.2))
    axes.plot([pose.x_m for pose in seen], [pose.y_m for pose in seen], color=color, linewidth=1.2)
    axes.add_patch(Circle((x_m, y_m), radius, color=color, alpha=0.4))
    nose = (x_m + radius * math.cos(heading), y_m + radius * math.sin(heading))
    axes.plot(*zip((x_m, y_m), nose, strict=True), color=color, linewidth=2)


def _write(frames: list[Image.Image], frame_ms: float, path: Path) -> None:
    times = [round(frame_ms)] * (len(frames) - 1) + [LAST_MS]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=times, loop=0, optimize=True)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
