"""Determine which axis of a world points up.

Before R2020b the y axis of every world pointed up. Since then WorldInfo.coordinateSystem selects the axis.
Before R2022a, the default value meant y, and since then it means z. Source: WbWorldInfo of Webots.
"""

from __future__ import annotations

from typing import Final

from palaestra_sim.scene.frames import Frame, YUp
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.old_axes import of_old_axes
from palaestra_sim.scene.validation import NodeReader

_SYSTEMS: Final = ("ENU", "NUE", "EUN")


def read_axes(reading: NodeReader, node: SceneNode) -> Frame | None:
    """Return a frame around the world if its y axis points up, else None; also set `reading.system`.

    `node` is the WorldInfo of the world, or its first node.
    """
    system = node.text("coordinateSystem") or ("NUE" if of_old_axes(node) else "ENU")
    if system not in _SYSTEMS:
        known = ", ".join(_SYSTEMS)
        reading.refuse(node, f'coordinateSystem "{system}" is not one of {known}', "write one of them")
        return None
    reading.system = system
    return YUp() if system.index("U") == 1 else None
