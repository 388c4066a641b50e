"""Draw the drives of a trained policy from above: `python -m tests.monitoring.drives RUN`.

docs/images/drives.png    six episodes that the policy never saw, in the included simulator
"""

import sys
from contextlib import closing
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from palaestra_trainer import load_policy
from palaestra_trainer.environments import arena
from palaestra_trainer.environments.move_to_target import REACHED_M
from palaestra_trainer.simulators.connect import OwnSimulator
from palaestra_trainer.simulators.entry_point import make
from tests.local_run import ROOT

PICTURE = ROOT / "docs/images/drives.png"
SEEDS = range(1000, 1006)
SIDE_IN, DPI = 4.6, 110
WALL_M = 0.06


def main(run: str) -> int:
    """Draw the drives of the policy in a run directory."""
    drives = _drives(run)
    with mpl.rc_context({"font.size": 8}):
        figure = Figure(figsize=(SIDE_IN, SIDE_IN), dpi=DPI, layout="tight")
        axes = figure.add_subplot()
        _draw_arena(axes)
        for number, (places, target, _) in enumerate(drives):
            _draw_drive(axes, places, target, f"C{number}")
        reaches = sum(reached for _, _, reached in drives)
        axes.set_title(f"{reaches} of {len(drives)} drives reach their target", loc="left", weight="bold")
        figure.savefig(PICTURE)
    return 0


def _drives(run: str) -> list[tuple[list[arena.Point], arena.Point, bool]]:
    """Return positions (m), target (m) and success of an episode for each seed."""
    policy = load_policy(run)
    with closing(OwnSimulator()) as simulator:
        env = make(simulator.robot, simulator.scene, **policy.environment_options)
        return [_drive(policy, env, simulator.robot, seed) for seed in SEEDS]


def _drive(policy: Any, env: Any, robot: Any, seed: int) -> tuple[list[arena.Point], arena.Point, bool]:
    observation, info = env.reset(seed=seed)
    target, ended = info["target"], False
    places = [robot.pose()]
    while not ended:
        action, _ = policy.predict(observation)
        observation, _, terminated, truncated, info = env.step(action)
        places.append(robot.pose())
        ended = terminated or truncated
    return [(pose.x_m, pose.y_m) for pose in places], tuple(target), info["is_success"]


def _draw_arena(axes: Axes) -> None:
    half = arena.HALF_SIDE_M
    whole = half + WALL_M
    axes.add_patch(Rectangle((-whole, -whole), 2 * whole, 2 * whole, color="0.35"))
    axes.add_patch(Rectangle((-half, -half), 2 * half, 2 * half, color="0.97"))
    for place in arena.CYLINDERS:
        axes.add_patch(Circle(place, arena.CYLINDER_RADIUS_M, color="0.55"))
    axes.set(xlim=(-whole, whole), ylim=(-whole, whole), aspect="equal")
    axes.set_axis_off()


def _draw_drive(axes: Axes, places: list[arena.Point], target: arena.Point, color: str) -> None:
    """Draw the target as a ring, the path as a line, and the robot at its start (dashed) and its end."""
    axes.add_patch(Circle(target, REACHED_M, fill=False, color=color, linewidth=1.2))
    axes.plot(*zip(*places, strict=True), color=color, linewidth=1.4)
    axes.add_patch(Circle(places[0], arena.OUTLINE_M, fill=False, color=color, linestyle=":", linewidth=1))
    axes.add_patch(Circle(places[-1], arena.OUTLINE_M, color=color, alpha=0.25))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
