"""Worlds in MJCF, the XML of MuJoCo: the description of the robot, checks, and names.

Pure text, as all of `world`: MuJoCo itself is not needed to check or to name such a world.

- `elements`: the elements of an XML file with their places
- `description`: robot, arguments, basic step and devices, from the element `custom`
- `files`: the files that a model names
- `growing`: elements that would take all memory
- `checks`: the mistakes that make a world unusable
- `naming`: the world of one simulator
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
from palaestra_sim.world.mjcf.elements import read
from palaestra_sim.world.mjcf.files import in_project, named_files, named_folders, parts, strays
from palaestra_sim.world.mjcf.growing import growing
from palaestra_sim.world.mjcf.naming import generate, rename, robots

__all__ = [
    "LEFT_OUT",
    "Description",
    "check",
    "describe",
    "fits",
    "fitting_timesteps_s",
    "generate",
    "growing",
    "in_project",
    "is_mjcf",
    "named_files",
    "named_folders",
    "parts",
    "read",
    "rename",
    "robots",
    "strays",
    "whole_step_ms",
    "with_parts",
]
