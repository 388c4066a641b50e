"""Draw a recorded episode from above as SVG: floor, obstacles, target, and the path of the robot.

The picture is complete without a script. The script of the page moves the robot along its path, and shows
the episode in three dimensions instead if it was recorded so and the browser has WebGL.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from palaestra_protocol.scene import TARGET_M, VisibleScene
from palaestra_trainer.reporting.elements import Markup, element, joined, json_script
from palaestra_trainer.reporting.run_data import Replay
from palaestra_trainer.reporting.space import in_space, space_data

MARGIN_M = 0.15


def replay_figure(replay: Replay, scenes: Sequence[VisibleScene]) -> Markup:
    """Return a recorded episode as a figure with a picture, buttons and a slider.

    `scenes` has the scenes of the page's section, and among them the scene of the replay, if it has one.
    """
    low_x, low_y, width, height = view_of(replay)
    first_x, first_y = replay.poses[0][:2] if replay.poses else (0.0, 0.0)
    size = max(width, height)
    picture = element(
        "svg",
        element(
            "g",
            _floor(replay),
            *[_outline(outline) for outline in replay.outlines],
            _target(replay),
            element("polyline", points=_way(replay), class_="way", stroke_width=size / 180),
            element("circle", cx=first_x, cy=first_y, r=size / 110, class_="start"),
            _robot(replay),
            transform="scale(1 -1)",
        ),
        viewBox=f"{low_x:.3f} {-(low_y + height):.3f} {width:.3f} {height:.3f}",
        role="img",
        aria_label=f"{replay.title} episode from above",
    )
    return element(
        "figure",
        element("figcaption", element("b", replay.title), f" {replay.facts}"),
        picture,
        in_space(replay),
        _controls(replay),
        json_script(_for_script(replay) | space_data(replay, scenes)),
        class_="replay",
    )


def view_of(replay: Replay) -> tuple[float, float, float, float]:
    """Return the smallest x, the smallest y, the width and the height of the picture, in meters."""
    xs = [pose[0] for pose in replay.poses] + [x for _, x, _ in replay.targets]
    ys = [pose[1] for pose in replay.poses] + [y for _, _, y in replay.targets]
    for corner in (replay.low, replay.high):
        if corner is not None:
            xs.append(corner[0])
            ys.append(corner[1])
    if not xs:
        return -1.0, -1.0, 2.0, 2.0
    pad = MARGIN_M + (0.0 if replay.low else replay.radius_m)
    low_x, low_y = min(xs) - pad, min(ys) - pad
    return low_x, low_y, max(xs) + pad - low_x, max(ys) + pad - low_y


def _floor(replay: Replay) -> Markup:
    if replay.low is None or replay.high is None:
        return joined()
    return element(
        "rect",
        x=replay.low[0],
        y=replay.low[1],
        width=replay.high[0] - replay.low[0],
        height=replay.high[1] - replay.low[1],
        class_="floor",
    )


def _outline(outline: tuple[float, float, float, float, float, float]) -> Markup:
    x, y, half_length, half_width, radius, heading = outline
    if not (half_length or half_width):
        return element("circle", cx=x, cy=y, r=radius, class_="obstacle")
    return element(
        "rect",
        x=-half_length - radius,
        y=-half_width - radius,
        width=2 * (half_length + radius),
        height=2 * (half_width + radius),
        rx=radius,
        transform=f"translate({x:.3f} {y:.3f}) rotate({math.degrees(heading):.1f})",
        class_="obstacle",
    )


def _target(replay: Replay) -> Markup:
    if not replay.targets:
        return joined()
    _, x, y = replay.targets[0]
    ring = element("circle", r=TARGET_M, class_="ring")
    return element(
        "g", ring, element("circle", r=0.04, class_="spot"), class_="target", transform=f"translate({x} {y})"
    )


def _robot(replay: Replay) -> Markup:
    x, y, heading = replay.poses[0] if replay.poses else (0.0, 0.0, 0.0)
    radius = replay.radius_m
    return element(
        "g",
        element("circle", r=radius, class_="body"),
        element(
            "path", d=f"M{radius:.3f} 0L{-radius / 3:.3f} {radius / 2:.3f}V{-radius / 2:.3f}z", class_="nose"
        ),
        class_="robot",
        transform=f"translate({x} {y}) rotate({math.degrees(heading):.1f})",
    )


def _way(replay: Replay) -> str:
    return " ".join(f"{x:.3f},{y:.3f}" for x, y, _ in replay.poses)


def _controls(replay: Replay) -> Markup:
    last = max(len(replay.poses) - 1, 0)
    return element(
        "div",
        element(
            "button", "\u25b6", type="button", class_="play", aria_label=f"play the {replay.title} episode"
        ),
        element(
            "input",
            type="range",
            min="0",
            max=str(last),
            value="0",
            class_="at",
            aria_label=f"time in the {replay.title} episode",
        ),
        element("output", f"0.0 of {last * replay.frame_s:.1f} s"),
        element("button", "3D", type="button", class_="view", hidden="") if replay.space else joined(),
        class_="controls",
    )


def _for_script(replay: Replay) -> dict[str, object]:
    """Return the data for the page's script; whole millimeters and degrees keep the data short."""
    return {
        "s": replay.frame_s,
        "poses": [
            [round(1000 * x), round(1000 * y), round(math.degrees(heading))] for x, y, heading in replay.poses
        ],
        "targets": [[frame, round(1000 * x), round(1000 * y)] for frame, x, y in replay.targets],
    }
