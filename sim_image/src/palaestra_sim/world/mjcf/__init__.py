"""Worlds in MJCF, the XML of MuJoCo: the description of the robot, checks, and names.

This package checks and names such a world without MuJoCo. All modules except `project` handle only text.

- `elements`: the elements of an XML file with their positions
- `description`: robot, arguments, basic step and devices, from the element `custom`
- `files`: the files that a model names
- `part_files`: the number of times that each of these files is part of the model
- `project`: these files on disk, and the folder that holds them
- `size_checks`: checks for elements that would need too much memory
- `checks`: the mistakes that make a world unusable
- `naming`: generates the world of one simulator
"""

from palaestra_sim.world.mjcf.checks import check
from palaestra_sim.world.mjcf.description import (
    LEFT_OUT,
    Description,
    describe,
    fits,
    fitting_timesteps_s,
    is_mjcf,
    whole_step_ms,
    with_parts,
)
from palaestra_sim.world.mjcf.naming import generate, rename, robots
from palaestra_sim.world.mjcf.project import Project

__all__ = [
    "LEFT_OUT",
    "Description",
    "Project",
    "check",
    "describe",
    "fits",
    "fitting_timesteps_s",
    "generate",
    "is_mjcf",
    "rename",
    "robots",
    "whole_step_ms",
    "with_parts",
]
