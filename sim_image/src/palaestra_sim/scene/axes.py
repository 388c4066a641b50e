"""Axes: which axis of a world points up, and the conventions of nodes since R2022a.

Before R2020b the y axis of every world pointed up; since then WorldInfo.coordinateSystem chooses, with y as
the default until R2022a. Before R2022a robots looked along -z, cylinders stood along y, and many devices
looked along other axes. Webots turns the nodes of such files when it loads them; the stub turns the shapes
alone, and refuses the rest.
Source: WbNodeUtilities::fixBackwardCompatibility and WbWorldInfo of Webots.
"""

from __future__ import annotations

import math
from typing import Final

from palaestra_sim.scene.geometry import Pose, from_axis_angle, to_axis_angle
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.places import Place, YUp
from palaestra_sim.scene.reading import Reading

_CONVERT: Final = (
    "convert it (wiki of Webots: How to adapt your world or PROTO to Webots R2022a),"
    " leave WorldInfo out (--leave-out) to read it with the axes of today,"
    " or run this world with driver webots"
)
_UP: Final = {"ENU": "z", "NUE": "y", "EUN": "y"}
_X_TO_MINUS_Z: Final = (0.0, -1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0)
_Z_TO_Y: Final = Pose(rotation=from_axis_angle((1.0, 0.0, 0.0, -math.pi / 2.0)))


def read_axes(reading: Reading, node: SceneNode) -> Place | None:
    """Return the frame around a world whose y axis points up, None if it is z; note nodes with other axes.

    `node` is the WorldInfo of the world, or its first node.
    """
    if of_old_axes(node):
        fact = f"a world of {_release(node)}: before R2022a, robots, devices and shapes had other axes"
        reading.lacks(node, fact, _CONVERT)
    system = node.text("coordinateSystem") or ("NUE" if of_old_axes(node) else "ENU")
    if system not in _UP:
        known = ", ".join(_UP)
        reading.refuse(node, f'coordinateSystem "{system}" is none of {known}', "write one of them")
    return YUp() if _UP.get(system) == "y" else None


def of_old_axes(node: SceneNode) -> bool:
    """Return whether a node was written in a file from before R2022a."""
    return node.origin is not None and node.origin.source.older_than(2022, "")


def standing(node: SceneNode, frame: Pose) -> Pose:
    """Return the frame of a Cylinder, Capsule or Plane whose axis is z, although it was y in its file."""
    if not of_old_axes(node) or any(around.stand_in for around in node.ancestors()):
        return frame
    return frame.after(_Z_TO_Y)


def looking(node: SceneNode, place: Place) -> Place:
    """Return the frame of a camera that looks along x with z up; in an old file it is -z with y up."""
    if not of_old_axes(node):
        return place
    return Place(place, (0.0, 0.0, 0.0), to_axis_angle(_X_TO_MINUS_Z))


def frame_of_shapes(owner: SceneNode) -> Pose:
    """Return the frame of the shapes of a node; those of a stand-in are of today, also in an old file."""
    return _Z_TO_Y if owner.stand_in and of_old_axes(owner) else Pose()


def _release(node: SceneNode) -> str:
    """Return the release in the first line of the file of a node."""
    return "" if node.origin is None else node.origin.source.header().split()[-2]
