"""Nodes of files from before R2022a; Webots converts the axes of these nodes when it loads the files.

In these files robots looked along -z, cylinders stood along y, and many devices looked along other axes.
Webots rotates these nodes, and the instances of its own PROTOs, whose files have the current axes. This
module also rotates a RangeFinder, so that it looks in the direction that the author of the world intended.
Source: WbNodeUtilities::fixBackwardCompatibility of Webots.
"""

from __future__ import annotations

from typing import Final

from palaestra_sim.scene.frames import Y_UP, Frame
from palaestra_sim.scene.geometry import AxisAngle, Matrix, Pose, to_axis_angle, transposed, turned
from palaestra_sim.scene.nodes.scene_node import SceneNode

# The columns of each matrix are the axes of current Webots versions, in the axes of the file.
_LOOKING: Final[Matrix] = (0.0, -1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0)
_POINTING: Final[Matrix] = (0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
_STANDING: Final = Pose(rotation=transposed(Y_UP))


def of_old_axes(node: SceneNode) -> bool:
    """Return whether a node was written in a file from before R2022a."""
    return node.origin is not None and node.origin.source.older_than(2022, "")


def standing(node: SceneNode, frame: Pose) -> Pose:
    """Return the frame of a shape or Track, which stands along z, or along y in an old file."""
    if not of_old_axes(node) or any(around.stand_in for around in node.ancestors()):
        return frame
    return frame.after(_STANDING)


def looking(node: SceneNode, place: Frame) -> Frame:
    """Return the frame of a device that looks along x with z up, or in an old file along -z with y up."""
    return _in_axes(node, place, _LOOKING)


def pointing(node: SceneNode, place: Frame) -> Frame:
    """Return the frame of a device that points along x with z up, or in an old file along z with y up."""
    return _in_axes(node, place, _POINTING)


def of_instance(node: SceneNode, rotation: AxisAngle) -> AxisAngle:
    """Return the rotation of a node; Webots rotates instances of its own PROTOs in old files."""
    if not (node.shipped and of_old_axes(node)):
        return rotation
    return turned(rotation, _LOOKING)


def _in_axes(node: SceneNode, place: Frame, axes: Matrix) -> Frame:
    if not of_old_axes(node):
        return place
    return Frame(place, (0.0, 0.0, 0.0), to_axis_angle(axes))
