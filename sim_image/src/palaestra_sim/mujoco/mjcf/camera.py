"""A camera of an MJCF model, which implements `CameraInterface`.

Its images show the geoms, materials and lights of the model.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.gl_context import canvas
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.mujoco.pixels import blue_first
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.camera_interface import Corners, Lens
from palaestra_sim.scene.nodes.scene_node import SceneNode

_MOST_GEOMS: Final = 10_000


class ModelCamera:
    """Renders the images of one camera of a model."""

    def __init__(self, model: Model, number: int, lens: Lens) -> None:
        self._model = model
        self._lens = lens
        self._camera: Any = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
        self._camera.fixedcamid = number
        self._option: Any = mujoco.MjvOption()
        self._scene: Any = None

    def open(self) -> None:
        """Prepare to render.

        Raises:
            UnsimulatedError: this machine cannot render.
        """
        canvas()

    def colors(self) -> memoryview:
        """Return four bytes for each pixel: blue, green, red, alpha."""
        model, size = self._model.model, self._lens.size
        self._model.settle()
        context = canvas().take(self._model, model, size)
        if self._scene is None:
            self._scene = mujoco.MjvScene(model, maxgeom=_MOST_GEOMS)
        up = math.tan(self._lens.field_of_view_rad / 2.0) * size[1] / size[0]
        model.cam_fovy[self._camera.fixedcamid] = math.degrees(2.0 * math.atan(up))
        every = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(model, self._model.data, self._option, None, self._camera, every, self._scene)
        rect = mujoco.MjrRect(0, 0, *size)
        mujoco.mjr_render(rect, self._scene, context)
        read = np.empty((size[1], size[0], 3), np.uint8)
        mujoco.mjr_readPixels(read, None, rect, context)
        return blue_first(read)

    def depths(self, nearest_m: float, resolution_m: float) -> memoryview:
        """Raise an error: a model has no RangeFinder."""
        del nearest_m, resolution_m
        raise UnsimulatedError("a camera of a model does not measure distances; add <rangefinder> sensors")

    def patches(self, owner: Callable[[SceneNode], SceneNode | None]) -> dict[SceneNode, Corners]:
        """Return an empty mapping: a camera of a model has no Recognition node."""
        del owner
        return {}

    def painted(self, color: Callable[[SceneNode], bytes | None]) -> memoryview:
        """Return the unchanged image: a camera of a model has no Recognition node."""
        del color
        return self.colors()
