"""Lay a generated world out as a Webots project, around which Webots finds what the source world has.

Webots takes the parent of a world's folder as its project, and looks there for `controllers/<name>/`, PROTOs
and plugins. If a controller is missing, it starts `<generic>`, with a warning only. So the generated world
gets a folder like that of its source, with links to everything beside the source and beside its folder. A
world that names files above its project gets the folders up to them, with such links in each.

A world from a ConfigMap has no project: the files beside its folder belong to others and are not linked.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from palaestra_sim.errors import SidecarError
from palaestra_sim.world import own_controllers, placed

# Source: Webots' guide, "The Standard File Hierarchy of a Project". One of them makes a folder a project.
FOLDERS = ("controllers", "libraries", "plugins", "protos")
# Source: Filesystem Hierarchy Standard 3.0, with /proc and /sys. A world in /worlds needs none of them.
_OF_THE_SYSTEM = frozenset(
    {
        *("bin", "boot", "dev", "etc", "lib", "lib32", "lib64", "libx32", "lost+found"),
        *("proc", "root", "run", "sbin", "sys", "tmp", "usr", "var"),
    }
)
_EXTRA_PROJECTS = "WEBOTS_EXTRA_PROJECT_PATH"  # a list, as PATH
_MOST_NAMED = 20  # robots in a warning, which is one line of the log


def has_project(world: Path) -> bool:
    """Return whether a world, given by its absolute path, is in a Webots project."""
    root = world.parent.parent
    return root != world.parent and any(_is_folder(root / name) for name in FOLDERS)


def lay_out(world: Path, project: Path, root: Path, *, linked: bool) -> Path:
    """Return the folder for a world that is made from `world`, in the folder `project`.

    With `linked`, everything that is beside `world`, and beside each folder from it up to `root`, is linked
    at the same relative place. Links of an earlier start are renewed. All paths are absolute.

    Raises:
        SidecarError: `project` is the project of `world` itself, or that cannot be read.
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
            made.unlink()  # it was beside the folder of another world of this project
        made.mkdir(parents=True, exist_ok=True)
    for link in [link for made in folders for link in made.iterdir()]:
        if link not in wanted and _is_ours(link, folders.values()):
            link.unlink()
    for link, target in wanted.items():
        _link(link, target)
    return folder


def missing_controllers(world: Path, source: bytes, environment: Mapping[str, str]) -> str | None:
    """Return a warning about the robots of a world without a project whose controllers Webots cannot find.

    None if every controller can be found. `environment` is that of Webots: it may name more projects.

    Raises:
        WorldError: `source` is no world file.
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
        f"--world: {world}: is in no Webots project, so Webots starts <generic> for controllers that it "
        f"lacks: {named}; put the project into spec.simulators[].image and name its world in "
        "spec.simulators[].world.file"
    )


def _folders(world: Path, project: Path, root: Path) -> Iterator[tuple[Path, Path]]:
    """Yield the folders to make for a world, from `project` to its own, each with the one it stands for."""
    names = world.parent.relative_to(root).parts
    if not names:  # no project is around it
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
    """Yield what is in `source`, except what the system owns and what contains `folder`, which would loop."""
    for path in source.iterdir():
        of_the_system = source == source.parent and path.name in _OF_THE_SYSTEM
        if not of_the_system and not folder.is_relative_to(path):
            yield path


def _is_ours(link: Path, sources: Collection[Path]) -> bool:
    """Return whether an earlier start of this container made this link to what is in one of `sources`."""
    if not link.is_symlink():
        return False
    target = link.readlink()
    return target.name == link.name and target.parent in sources


def _link(link: Path, target: Path) -> None:
    """Make a link; keep an equal one, which the other simulator may be using, and a world written there."""
    if link.is_symlink():
        if link.readlink() == target:
            return
        link.unlink()
    if not link.exists():
        link.symlink_to(target)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # it may not be read, by Webots neither
        return False


def _same(one: Path, other: Path) -> bool:
    return one.exists() and one.resolve() == other.resolve()
