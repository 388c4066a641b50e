"""The folder that holds a world and all files that the world names."""

from pathlib import Path

from palaestra_sim.errors import RootError
from palaestra_sim.world import mjcf
from palaestra_sim.world.checks import relative_addresses
from palaestra_sim.world.paths import climb, is_relative


def placed(world: Path) -> Path:
    """Return the absolute path of a world; its parents are its folder and its project."""
    return world.parent.resolve() / world.name if ".." in world.parts else world.absolute()


def root_of(world: Path, source: bytes, given: Path | None = None) -> Path:
    """Return `given`, or the nearest folder that holds a world and all files that the world names.

    The nearest folder is the Webots project of the world, or a folder above that project. `world` is a path
    that `placed` has returned.

    Raises:
        RootError: `given` is not above the world, or does not hold all files that the world names.
        WorldError: a file of the model is wrong, or leads to the root of the file system.
        OSError: a file of the model cannot be read.
    """
    folders = world.parents
    nearest = folders[min(_levels(source, world, given), len(folders) - 1)]
    if given is None:
        return folders[1] if nearest == folders[0] and len(folders) > 1 else nearest
    root = placed(given)
    if root not in folders:
        raise RootError(f"{root}: is not a folder above {world}; name a folder that contains the world")
    if not nearest.is_relative_to(root):
        raise RootError(f"{root}: the world refers to files outside of this folder; name {nearest}")
    return root


def _levels(source: bytes, world: Path, given: Path | None) -> int:
    """Return the number of folders by which existing files that a world names lead above its folder."""
    if mjcf.is_mjcf(source):
        project = mjcf.Project(world, mjcf.describe(source, str(world)), given)
        project.open()
        return project.levels
    addresses = filter(is_relative, relative_addresses(source, str(world)))
    return max((climb(it) for it in addresses if (world.parent / it).exists()), default=0)
