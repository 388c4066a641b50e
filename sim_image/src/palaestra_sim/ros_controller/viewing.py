"""The data of a running simulator for viewers: visible shapes, poses, and the pictures of a camera."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from palaestra_protocol.camera_picture import MOST_SIDE, CameraPicture
from palaestra_protocol.control import VIEW_CAMERA, VIEW_SCENE, VIEW_STATE
from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_sim.ros_controller.simulator import RunningSimulator


class _Json(Protocol):
    def to_json(self) -> dict[str, Any]: ...


def answers(simulator: RunningSimulator) -> Mapping[bytes, Callable[[], bytes]]:
    """Return, for each request of a sidecar, the function that computes the response."""

    def scene() -> VisibleScene:
        return simulator.simulation.appearance.scene(simulator.world_path.name)

    def state() -> SceneState:
        simulation = simulator.simulation
        return simulation.appearance.state(simulation.time_ms)

    def camera() -> bytes:
        """Return the newest picture of the first camera that has sent one; `null` if no camera has."""
        controllers = simulator.controllers.values()
        newest = next((picture for controller in controllers for picture in controller.pictures()), None)
        return b"null" if newest is None else _written(_reduced(*newest))

    return {
        VIEW_SCENE: lambda: _written(scene()),
        VIEW_STATE: lambda: _written(state()),
        VIEW_CAMERA: camera,
    }


def _reduced(name: str, size: tuple[int, int], pixels: bytes | memoryview) -> CameraPicture:
    """Return the picture of `pixels` (blue, green, red, alpha); if it is too large, drop rows and columns."""
    width, height = size
    every = math.ceil(max(size) / MOST_SIDE)
    cells = memoryview(pixels).cast("B").cast("I")
    rows = [cells[row * width : (row + 1) * width : every].tobytes() for row in range(0, height, every)]
    kept = b"".join(rows)
    colors = bytearray(len(kept) // 4 * 3)
    for channel, place in enumerate((2, 1, 0)):
        colors[channel::3] = kept[place::4]
    return CameraPicture(name=name, width=len(rows[0]) // 4, height=len(rows), pixels=bytes(colors))


def _written(content: _Json) -> bytes:
    return json.dumps(content.to_json()).encode()
