"""Render images of a world: the color, the distance, or the shape of each pixel.

The renderer uses a separate model, which has only the visible shapes. So the model of the physics needs no
colors, and the visible shapes may differ from the obstacles. Before each image, the shapes on robots and
joints get their current poses. The other shapes get new poses only after a client has moved one of them.
"""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.gl_context import canvas
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.pixels import blue_first
from palaestra_sim.mujoco.visual_model import SKY, SUN, VisualModel, build, glow
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose
from palaestra_sim.scene.visuals import Drawn, View

_HORIZON_M: Final = 1000.0  # the view distance of a camera without `far`
_BEYOND: Final = 1.1  # far end of the frustum divided by the distance to the sky, so that the sky is inside
# Webots' cameras look along x with z up; MuJoCo's look along -z with y up. Columns: right, up, back.
_TURNED: Final = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


class Renderer:
    """Renders one world.

    Args:
        view: the visible shapes of the world.
    """

    def __init__(self, view: View) -> None:
        self._view = view
        self._seen = (-1, -1)  # the view's counts of changes and of moves when the model was last updated
        self._visible: VisualModel = build((), (0.0, 0.0, 0.0), SUN)
        self._carried: list[tuple[Frame, slice, Any, Any]] = []

    @property
    def things(self) -> tuple[Drawn, ...]:
        """The visible shapes of the last image; `segments` returns indices of this tuple."""
        return self._visible.things

    def placed(self) -> VisualModel:
        """Return the model with every shape at its current pose."""
        self._refresh()
        return self._visible

    def open(self) -> None:
        """Prepare to render.

        Raises:
            UnsimulatedError: this machine cannot render; the message names the packages to install.
        """
        canvas()

    def colors(self, place: Frame, lens: Lens) -> memoryview:
        """Return four bytes for each pixel (blue, green, red, alpha), row by row from the top left."""
        context, rect = self._draw(place, lens)
        width, height = lens.size
        read = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(read, None, rect, context)
        return blue_first(read)

    def depths(self, place: Frame, lens: Lens) -> Any:
        """Return the distance of each pixel along the axis of the lens, in meters: (height, width) float32.

        A distance beyond the view distance of the lens is infinite.
        """
        context, rect = self._draw(place, lens, segments=True)
        width, height = lens.size
        read = np.empty((height, width), np.float32)
        mujoco.mjr_readPixels(None, read, rect, context)
        near, far = lens.near_m, _BEYOND * _far(lens)
        # The depth buffer is 1 at the near end and 0 at the far end; it is linear in 1 / distance.
        depths = read[::-1].astype(np.float64)
        meters = near * far / (near + depths * (far - near))
        meters[meters > _far(lens)] = math.inf
        return meters.astype(np.float32)

    def segments(self, place: Frame, lens: Lens) -> Any:
        """Return the index in `things` of the shape in each pixel: (height, width) int32; -1 for no shape."""
        context, rect = self._draw(place, lens, segments=True)
        width, height = lens.size
        read = np.empty((height, width, 3), np.uint8)
        mujoco.mjr_readPixels(read, None, rect, context)
        numbers = read[::-1].astype(np.int32) @ np.array([1, 1 << 8, 1 << 16], np.int32) - 1
        geoms = self._visible.scene.geoms[: self._visible.scene.ngeom]
        owners = np.full(len(geoms) + 1, -1, np.int32)
        for geom in geoms:
            if geom.segid >= 0:
                owners[geom.segid] = geom.objid
        return owners[numbers]

    def _draw(self, place: Frame, lens: Lens, *, segments: bool = False) -> tuple[Any, Any]:
        """Render an image; return the context and the rectangle from which it can be read."""
        self._refresh()
        visible = self._visible
        model, scene = visible.model, visible.scene
        context = canvas().take(visible, model, lens.size)
        self._aim(place, lens)
        visible.option.geomgroup[SKY] = not segments
        mujoco.mjv_updateScene(
            model, visible.data, visible.option, None, visible.camera, mujoco.mjtCatBit.mjCAT_ALL.value, scene
        )
        scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = False
        scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = segments
        scene.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = segments
        rect = mujoco.MjrRect(0, 0, *lens.size)
        mujoco.mjr_render(rect, scene, context)
        return context, rect

    def _aim(self, place: Frame, lens: Lens) -> None:
        """Place the camera at a frame, and the sky at the end of the camera's view."""
        model, data = self._visible.model, self._visible.data
        pose = place.world_pose
        turned = np.reshape(pose.rotation, (3, 3))
        data.cam_xpos[0] = pose.position
        data.cam_xmat[0] = (turned @ _TURNED).ravel()
        width, height = lens.size
        across = math.tan(lens.field_of_view_rad / 2.0)
        up = across * height / width
        far_m = _far(lens)
        model.cam_fovy[0] = math.degrees(2.0 * math.atan(up))
        model.vis.map.znear, model.vis.map.zfar = lens.near_m, _BEYOND * far_m
        forward = turned[:, 0]
        model.geom_size[-1] = lens.near_m, across * far_m, up * far_m
        model.mat_emission[0] = glow(forward.tolist(), self._visible.sun)
        data.geom_xpos[-1] = pose.position + far_m * forward
        data.geom_xmat[-1] = turned.ravel()

    def _refresh(self) -> None:
        """Set every shape to its current pose."""
        seen = (self._view.changes, self._view.moves)
        if seen[0] != self._seen[0]:
            things = self._view.things()
            place = next((thing.place for thing in things if thing.place is not None), None)
            sun = SUN if place is None else place.from_ground(SUN)
            self._visible = build(things, self._view.sky(), sun)
        if seen != self._seen:
            self._seen = seen
            self._place_all()
        positions, rotations = self._visible.data.geom_xpos, self._visible.data.geom_xmat
        for carrier, part, offsets, turns in self._carried:
            pose = carrier.world_pose
            turned = np.reshape(pose.rotation, (3, 3))
            positions[part] = offsets @ turned.T + pose.position
            rotations[part] = (turned @ turns).reshape(-1, 9)

    def _place_all(self) -> None:
        """Set the poses of shapes that do not move; record the frames that carry the other shapes."""
        visible = self._visible
        self._carried = []
        for place, group in groupby(range(len(visible.things)), lambda at: visible.things[at].place):
            indices = list(group)
            part = slice(indices[0], indices[-1] + 1)
            carrier = next((it for it in place.chain() if it.moves), None) if place is not None else None
            frame = Pose() if place is None else place.world_pose
            if carrier is not None:
                frame = carrier.world_pose.inverse.after(frame)
            turned = np.reshape(frame.rotation, (3, 3))
            offsets = visible.positions[part] @ turned.T + frame.position
            turns = turned @ visible.rotations[part]
            if carrier is not None:
                self._carried.append((carrier, part, offsets, turns))
            else:
                visible.data.geom_xpos[part] = offsets
                visible.data.geom_xmat[part] = turns.reshape(-1, 9)


def _far(lens: Lens) -> float:
    """Return the view distance of a lens, in meters."""
    return lens.far_m or _HORIZON_M
