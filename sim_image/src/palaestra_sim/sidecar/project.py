"""Lay a generated world out as a Webots project, in which Webots finds the files of the source world.

Webots takes the parent of a world's folder as its project, and looks there for `controllers/<name>/`, PROTOs
and plugins. If a controller is missing, Webots only prints a warning and starts `<generic>`. So the generated
world gets a folder like that of its source, with links to everything next to the source and next to its
folder. If a world names files above its project, the folders up to them are made too, each with such links.

A world from a ConfigMap has no project: the files next to its folder belong to others and are not linked.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from palaestra_sim.errors import SidecarError
from palaestra_sim.world import own_controllers, placed

# Source: Webots' guide, "The Standard File Hierarchy of a Project". A folder that has one of these is a
# project.
FOLDERS = ("controllers", "libraries", "plugins", "protos")
# The folders of the system, and /proc and /sys. A world in /worlds does not need them. Source: Filesystem
# Hierarchy Standard 3.0
_OF_THE_SYSTEM = frozenset(
    {
        *("bin", "boot", "dev", "etc", "lib", "lib32", "lib64", "libx32", "lost+found"),
        *("proc", "root", "run", "sbin", "sys", "tmp", "usr", "var"),
    }
)
_EXTRA_PROJECTS = "WEBOTS_EXTRA_PROJECT_PATH"  # a list, as PATH
_MOST_NAMED = 20  # robots named in a warning, which is one line of the log


def has_project(world: Path) -> bool:
    """Return whether a world, given by its absolute path, is in a Webots project."""
    root = world.parent.parent
    return root != world.parent and any(_is_folder(root / name) for name in FOLDERS)


def lay_out(world: Path, project: Path, root: Path, *, linked: bool) -> Path:
    """Return the folder for a world that is generated from `world`, in the folder `project`.

    With `linked`, everything next to `world`, and next to each folder from it up to `root`, is linked at the
    same relative path. Links of an earlier start are renewed. All paths are absolute.

    Raises:
        SidecarError: `project` is the project of `world` itself, or a folder cannot be read.
        OSError: the folder cannot be written.
    """
    folders = dict(_folders(world, project, root))
    *_, folder = folders
    if any(not made.is_symlink() and _same(made, source) for made, source in folders.items()):
        raise SidecarError(f"--work: {project.parent}: has the project of the world; give another folder")
    try:
        wanted = dict(_links(folders)) if linked else {}
    except OSError as error:
        raise SidecarError(f"--world: {error.filename}: {error.strerror}; make it readable") from error
    for made in folders:
        if made.is_symlink():
            made.unlink()  # a link from an earlier start, for another world of this project
        made.mkdir(parents=True, exist_ok=True)
    for link in [link for made in folders for link in made.iterdir()]:
        if link not in wanted and _is_ours(link, folders.values()):
            link.unlink()
    for link, target in wanted.items():
        _link(link, target)
    return folder


def missing_controllers(world: Path, source: bytes, environment: Mapping[str, str]) -> str | None:
    """Return a warning about robots whose controllers Webots cannot find, for a world without a project.

    None if every controller can be found. `environment` is that of Webots: it may name more projects.

    Raises:
        WorldError: `source` is not a world file.
    """
    if has_project(placed(world)):
        return None
    others = [Path(path) for path in environment.get(_EXTRA_PROJECTS, "").split(os.pathsep) if path]
    if home := environment.get("WEBOTS_HOME"):
        others.append(Path(home, "projects", "default"))
    missing = [
        f'"{robot}" (controller "{controller}")'
        for robot, controller in own_controllers(source, str(world))
        if not any(_is_folder(other / "controllers" / controller) for other in others)
    ]
    if not missing:
        return None
    more = len(missing) - _MOST_NAMED
    named = ", ".join(missing[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
    return (
        f"--world: {world}: is not in a Webots project, so Webots starts <generic> for controllers that it "
        f"lacks: {named}; put the project into spec.simulators[].image and name its world in "
        "spec.simulators[].world.file"
    )


def _folders(world: Path, project: Path, root: Path) -> Iterator[tuple[Path, Path]]:
    """Yield each folder to make for a world, from `project` to the world's own, with its source folder."""
    names = world.parent.relative_to(root).parts
    if not names:  # the world has no project
        yield project / "worlds", world.parent
        return
    for count in range(len(names) + 1):
        yield project.joinpath(*names[:count]), root.joinpath(*names[:count])


def _links(folders: Mapping[Path, Path]) -> Iterator[tuple[Path, Path]]:
    """Yield each link around the folder of the generated world, with its target."""
    *_, own = folders
    for made, source in folders.items():
        for neighbor in _inside(source, own):
            if made / neighbor.name not in folders:
                yield made / neighbor.name, neighbor


def _inside(source: Path, folder: Path) -> Iterator[Path]:
    """Yield the entries of `source` except system folders and the one with `folder`, which would loop."""
    for path in source.iterdir():
        of_the_system = source == source.parent and path.name in _OF_THE_SYSTEM
        if not of_the_system and not folder.is_relative_to(path):
            yield path


def _is_ours(link: Path, sources: Collection[Path]) -> bool:
    """Return whether an earlier start of this container made this link, to an entry of one of `sources`."""
    if not link.is_symlink():
        return False
    target = link.readlink()
    return target.name == link.name and target.parent in sources


def _link(link: Path, target: Path) -> None:
    """Make a link; keep an equal link, which the other simulator may be using, and keep a written world."""
    if link.is_symlink():
        if link.readlink() == target:
            return
        link.unlink()
    if not link.exists():
        link.symlink_to(target)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # Webots may not read it either
        return False


def _same(one: Path, other: Path) -> bool:
    return one.exists() and one.resolve() == other.resolve()
