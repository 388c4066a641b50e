"""The distances that lidar beams travel; MuJoCo casts the rays in the model of the visible shapes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.rays import bundles, origins_and_directions
from palaestra_sim.mujoco.renderer import Renderer
from palaestra_sim.mujoco.visual_model import PASSED, VisualModel
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.physics import Figure
from palaestra_sim.scene.sensor_rays import Beam

_GROUPS: Final = np.array([int(group == 0) for group in range(mujoco.mjNGROUP)], dtype=np.uint8)

_PAST_M: Final = 1e-6  # a ray that has passed a triangle continues at this distance behind the triangle
_MOST_TRIANGLES: Final = 100  # maximum number of triangles that one ray passes from behind


class LidarBeams:
    """The lidar beams of one robot; beams with the same origin are cast together.

    A beam passes through the robot itself. It also passes through a shape that contains the origin of the
    beam, because a camera does not show the inner side of a surface either.
    """

    def __init__(
        self, pictures: Renderer, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None
    ) -> None:
        self._pictures = pictures
        self._figure = figure
        self._mount = mount or figure.place
        self._reach = np.array([beam.reach_m for beam in beams])
        self._origins, self._directions = origins_and_directions(beams)
        self._bundles = bundles(self._origins)
        self._own: tuple[VisualModel | None, Any] = (None, np.empty(0, int))

    def cast(self) -> list[float]:
        """Return the distance in meters that each beam travels now; at most the reach of the beam."""
        visible = self._pictures.placed()
        pose = self._mount.world_pose
        turned = np.array(pose.rotation).reshape(3, 3)
        origins = self._origins @ turned.T + pose.position
        directions = self._directions @ turned.T
        distances = np.empty(len(self._reach))
        passed = [self._own_geoms(visible)]
        visible.model.geom_group[passed[0]] = PASSED
        for first, end in self._bundles:
            with _without(visible, _seen_from_below(visible, origins[first])):
                distances[first:end] = _cast(visible, origins[first], directions[first:end], passed)
        visible.model.geom_group[np.concatenate(passed)] = 0
        missed = (distances < 0.0) | (distances > self._reach)
        travelled: list[float] = np.where(missed, self._reach, distances).tolist()
        return travelled

    def _own_geoms(self, visible: VisualModel) -> Any:
        """Return the numbers of the robot's own geoms; they are computed once for each model."""
        if self._own[0] is not visible:
            carrier = self._figure.place
            places = [thing.place for thing in visible.things]
            carried = [
                at for at, place in enumerate(places) if place is not None and carrier in place.chain()
            ]
            self._own = (visible, np.array(carried, dtype=int))
        return self._own[1]


def _seen_from_below(visible: VisualModel, origin: Any) -> Any:
    """Return the numbers of the Planes that are above a point: only the upper side of a Plane is visible."""
    planes = visible.planes
    offsets = origin - visible.data.geom_xpos[planes]
    heights = np.sum(offsets * visible.data.geom_xmat[planes][:, 2::3], axis=1)
    return planes[heights < visible.model.geom_size[planes, 2]]


@contextmanager
def _without(visible: VisualModel, geoms: Any) -> Iterator[None]:
    """Hide some geoms until the end of the block; geoms that were hidden before stay hidden."""
    shown = geoms[visible.model.geom_group[geoms] == 0]
    visible.model.geom_group[shown] = PASSED
    try:
        yield
    finally:
        visible.model.geom_group[shown] = 0


def _cast(visible: VisualModel, origin: Any, directions: Any, passed: list[Any]) -> Any:
    """Return the distance along each beam to the first surface that faces the origin.

    Geoms that contain the origin are hidden, and their numbers are added to `passed`.
    """
    count = len(directions)
    hits, distances, normals = np.empty(count, np.int32), np.empty(count), np.empty((count, 3))
    while True:
        mujoco.mj_multiRay(
            visible.model,
            visible.data,
            origin,
            directions.ravel(),
            _GROUPS,
            True,
            -1,
            hits,
            distances,
            normals.ravel(),
            count,
            mujoco.mjMAXVAL,
        )
        from_inside = (distances >= 0.0) & (np.sum(normals * directions, axis=1) > 0.0)
        meshes = visible.model.geom_type[hits] == mujoco.mjtGeom.mjGEOM_MESH.value
        around = np.unique(hits[from_inside & ~meshes])
        if not len(around):
            for at in np.flatnonzero(from_inside):
                distances[at] = _beyond(visible, origin, directions[at], distances[at], hits[at])
            return distances
        visible.model.geom_group[around] = PASSED
        passed.append(around)


def _beyond(visible: VisualModel, origin: Any, direction: Any, distance_m: float, geom: int) -> float:
    """Return the distance to the first triangle that faces the origin, from a triangle seen from behind.

    A sheet with two sides has two triangles at the same distance, of which MuJoCo returns any one. Return -1
    if the ray meets no triangle that faces the origin.
    """
    normal, hit = np.empty(3), np.array([geom], np.int32)
    for _ in range(_MOST_TRIANGLES):
        if visible.faces(int(hit[0]), origin + (distance_m - _PAST_M) * direction, direction, 2.0 * _PAST_M):
            return distance_m
        distance_m += _PAST_M
        start = origin + distance_m * direction
        further = mujoco.mj_ray(visible.model, visible.data, start, direction, _GROUPS, True, -1, hit, normal)
        if further < 0.0:
            break
        distance_m += further
        if normal @ direction <= 0.0:
            return distance_m
    return -1.0
