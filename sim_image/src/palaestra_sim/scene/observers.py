"""The devices that use the outlines of all other objects: radars, and light sensors with occlusion."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

from palaestra_sim.scene.devices.light_sensor import LightSensor
from palaestra_sim.scene.devices.radar import Radar
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.outlines import outlines_of
from palaestra_sim.scene.radar_targets import echoes_of


class OutlineObservers:
    """The devices to which `show` passes new outlines.

    Args:
        devices: all devices of the world.
        mesh_files: the mesh files that nodes of the world name.
    """

    def __init__(self, devices: Iterable[object], mesh_files: MeshFiles) -> None:
        self._mesh_files = mesh_files
        every = tuple(devices)
        self._radars = tuple(it for it in every if isinstance(it, Radar))
        self._shaded = tuple(it for it in every if isinstance(it, LightSensor) and it.occlusion)

    def show(self, nodes: Collection[SceneNode], floors_m: Callable[[], tuple[float, ...]]) -> None:
        """Give the devices the current outlines of the world.

        Args:
            nodes: all nodes of the world.
            floors_m: returns the heights of the floors in meters.
        """
        if not (self._radars or self._shaded):
            return
        outlines = outlines_of(nodes, floors_m, self._mesh_files)
        for sensor in self._shaded:
            sensor.show(outlines)
        if self._radars:
            echoes = echoes_of(nodes, outlines)
            for radar in self._radars:
                radar.show(echoes)
