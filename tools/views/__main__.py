"""`python -m tools.views`: draw docs/images/arena.png and docs/images/camera.png."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene import picture_files
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.world import builtin

FOLDER: Final = Path(__file__).parents[2] / "docs" / "images"
SIZE: Final = (320, 240)


def main() -> None:
    """Draw the arena from its Viewpoint, and from a camera on the robot."""
    physics = MujocoPhysics()
    simulation = Simulation.load(builtin("arena"), physics)
    simulation.export_image(str(FOLDER / "arena.png"), 100)
    mast = Frame(simulation.robots[0].place, (0.1, 0.0, 0.45), (0.0, 0.0, 1.0, 0.5))
    leaning = Frame(mast, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.25))
    eye = physics.eye(leaning, Lens(size=SIZE, field_of_view_rad=1.2, near_m=0.01))
    if eye is not None:
        picture_files.save(str(FOLDER / "camera.png"), SIZE, eye.colors())


if __name__ == "__main__":
    main()
