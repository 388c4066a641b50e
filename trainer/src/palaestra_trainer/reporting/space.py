"""The parts of a page that show recorded episodes in three dimensions; the script space.js draws them.

The page contains the shapes of each world once. It does not contain the names of the world's nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from palaestra_protocol.scene import VisibleScene
from palaestra_trainer.reporting.elements import Markup, element, joined, json_script
from palaestra_trainer.reporting.run_data import Replay

MOST_NOTE = 300
WITHOUT_WEBGL = "This browser has no WebGL, so the episode is shown from above."


def in_space(replay: Replay) -> Markup:
    """Return the canvas for an episode in three dimensions, or the reason for its absence."""
    if replay.space is None:
        note = f"Not in 3D: {replay.not_in_space[:MOST_NOTE]}." if replay.not_in_space else ""
        return element("p", note, class_="soft flat") if note else joined()
    label = f"{replay.title} episode in 3D; drag or press arrow keys to turn, plus and minus to zoom"
    simplified = replay.space.scene.simplified
    note = f"{simplified:,} shapes are too large for a report: they are boxes, or left out."
    return joined(
        element("canvas", class_="space", hidden="", tabindex="0", role="img", aria_label=label),
        element("p", WITHOUT_WEBGL, class_="soft flat", hidden=""),
        element("p", note, class_="soft") if simplified else joined(),
    )


def scenes_script(scenes: Sequence[VisibleScene]) -> Markup:
    """Return the scenes of a section as data for the page's script."""
    return json_script([_shapes(scene.to_json()) for scene in scenes], "scenes")


def space_data(replay: Replay, scenes: Sequence[VisibleScene]) -> dict[str, Any]:
    """Return the poses of an episode as data for the page's script; {} if the episode has none."""
    space = replay.space
    if space is None:
        return {}
    frames = [[_short(number) for pose in frame for number in pose] for frame in space.frames]
    return {"space": {"scene": scenes.index(space.scene), "nodes": space.nodes, "frames": frames}}


def _shapes(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return the shapes of a scene without its names."""
    nodes = [{"pose": node["pose"], "shapes": node["shapes"]} for node in scene["nodes"]]
    return {"nodes": nodes, "meshes": scene["meshes"]}


def _short(number: float) -> float:
    """Return a number rounded to tenths of a millimeter; a whole number has no decimal point."""
    rounded = round(number, 4)
    return int(rounded) if rounded == int(rounded) else rounded
