"""The image of a whole world from its Viewpoint."""

from __future__ import annotations

from typing import Final

from palaestra_sim.scene import picture_files
from palaestra_sim.scene.camera_interface import CameraInterface, Lens
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.old_axes import looking
from palaestra_sim.scene.physics import Physics
from palaestra_sim.scene.validation import NodeReader

SIZE: Final = (800, 600)  # width and height in pixels; Webots uses the size of its window instead


def save_view(root: SceneNode, physics: Physics, path: str, quality: int) -> bool:
    """Save the view of a world as a PNG or JPEG file; return whether that was possible.

    Raises:
        UnsimulatedError: the path does not have the suffix of a PNG or JPEG file, or this machine cannot
            render.
    """
    camera = view(root, physics, SIZE)
    return camera is not None and picture_files.save(path, SIZE, camera.colors(), quality=quality)


def view(root: SceneNode, physics: Physics, size: tuple[int, int]) -> CameraInterface | None:
    """Return a camera at the current Viewpoint; None if the simulator does not render."""
    reading = NodeReader(mesh_files=MeshFiles())  # a Viewpoint names no file
    viewpoint = next((it for it in root.nodes() if it.type_name == "Viewpoint"), root)
    fov_rad = reading.number(viewpoint, "fieldOfView", 0.7854)  # along the image's longer side, as in Webots
    near_m, far_m = reading.number(viewpoint, "near", 0.05), reading.number(viewpoint, "far", 0.0)
    x, y, z = reading.vector(viewpoint, "position", (-10.0, 0.0, 0.0))
    ax, ay, az, angle_rad = reading.vector(viewpoint, "orientation", (0.0, 0.0, 1.0, 0.0))
    lens = Lens(size=size, field_of_view_rad=fov_rad, near_m=near_m, far_m=far_m)
    place = looking(viewpoint, Frame(None, (x, y, z), (ax, ay, az, angle_rad)))
    return physics.eye(place, lens)
