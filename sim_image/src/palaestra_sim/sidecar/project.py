"""Make a Webots project for a generated world, in which Webots finds the files of the source world.

Webots uses the parent of a world's folder as the project, and searches it for `controllers/<name>/`, PROTOs
and plugins. If a controller is missing, Webots only prints a warning and starts `<generic>`. So the project
of the generated world has links to all files and folders next to the source world, and next to the source
world's folder. If the source world names files above its project, the new project has folders up to these
files, with links in each folder.

A world from a ConfigMap has no project. The files next to its folder do not belong to the world, so they are
not linked.
"""

import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from palaestra_sim.errors import SidecarError
from palaestra_sim.world import own_controllers, placed

# If a folder has one of these subfolders, it is a project. Source: Webots' guide, "The Standard File
# Hierarchy of a Project".
FOLDERS = ("controllers", "libraries", "plugins", "protos")
# The folders of the operating system below /. They are not linked. For a world in /worlds, the project is /,
# but the world does not need the folders of the system. Source: Filesystem Hierarchy Standard 3.0
_OF_THE_SYSTEM = frozenset(
    {
        *("bin", "boot", "dev", "etc", "lib", "lib32", "lib64", "libx32", "lost+found"),
        *("proc", "root", "run", "sbin", "sys", "tmp", "usr", "var"),
    }
)
_EXTRA_PROJECTS = "WEBOTS_EXTRA_PROJECT_PATH"  # a list of folders, in the format of PATH
_MOST_NAMED = 20  # maximum number of robots that one warning names


def has_project(world: Path) -> bool:
    """Return whether the world at an absolute path is in a Webots project."""
    root = world.parent.parent
    return root != world.parent and any(_is_folder(root / name) for name in FOLDERS)


def lay_out(world: Path, project: Path, root: Path, *, linked: bool) -> Path:
    """Make a project and return the folder in it for the generated world.

    Args:
        world: the absolute path of the source world.
        project: the absolute path of the project to make.
        root: the absolute path of the outermost source folder. For each folder from `root` to the folder of
            `world`, the project gets a folder.
        linked: whether to link every other entry of the world's folder, and of each folder above it up to and
            including `root`, at the same relative path. Links of an earlier start are renewed.

    Raises:
        SidecarError: `project` is the project of `world` itself, or a folder cannot be read.
        OSError: the folder cannot be written.
    """
    folders = dict(_folders(world, project, root))
    *_, folder = folders
    if any(not made.is_symlink() and _same(made, source) for made, source in folders.items()):
        raise SidecarError(
            f"--work: {project.parent}: contains the source project of the world; give another folder"
        )
    try:
        wanted = dict(_links(folders)) if linked else {}
    except OSError as error:
        raise SidecarError(f"--world: {error.filename}: {error.strerror}; make it readable") from error
    for made in folders:
        if made.is_symlink():
            made.unlink()  # an earlier start, for another world of the same source project, made this link
        made.mkdir(parents=True, exist_ok=True)
    for link in [link for made in folders for link in made.iterdir()]:
        if link not in wanted and _is_ours(link, folders.values()):
            link.unlink()
    for link, target in wanted.items():
        _link(link, target)
    return folder


def missing_controllers(world: Path, source: bytes, environment: Mapping[str, str]) -> str | None:
    """Return a warning if a world has no project and Webots cannot find the controllers of some robots.

    Return None if Webots can find every controller.

    Args:
        world: the path of the world.
        source: the content of the world file.
        environment: the environment variables of Webots, which may name more projects.

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
    """Yield each folder to make, from `project` to the folder of the world, with its source folder."""
    names = world.parent.relative_to(root).parts
    if not names:  # the world has no project
        yield project / "worlds", world.parent
        return
    for count in range(len(names) + 1):
        yield project.joinpath(*names[:count]), root.joinpath(*names[:count])


def _links(folders: Mapping[Path, Path]) -> Iterator[tuple[Path, Path]]:
    """Yield each link to make in the folders of the project, with its target."""
    *_, own = folders
    for made, source in folders.items():
        for neighbor in _inside(source, own):
            if made / neighbor.name not in folders:
                yield made / neighbor.name, neighbor


def _inside(source: Path, folder: Path) -> Iterator[Path]:
    """Yield the entries of `source`, without system folders and without the entry that contains `folder`.

    A link to that entry would make a loop.
    """
    for path in source.iterdir():
        of_the_system = source == source.parent and path.name in _OF_THE_SYSTEM
        if not of_the_system and not folder.is_relative_to(path):
            yield path


def _is_ours(link: Path, sources: Collection[Path]) -> bool:
    """Return whether `link` leads to an entry of `sources`; an earlier start made such links."""
    if not link.is_symlink():
        return False
    target = link.readlink()
    return target.name == link.name and target.parent in sources


def _link(link: Path, target: Path) -> None:
    """Make a link, unless an equal link or a file already exists.

    An equal link is kept, because the other simulator of this sidecar may be using it. A file is kept,
    because it is a generated world.
    """
    if link.is_symlink():
        if link.readlink() == target:
            return
        link.unlink()
    if not link.exists():
        link.symlink_to(target)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # Webots cannot read such a folder either
        return False


def _same(one: Path, other: Path) -> bool:
    return one.exists() and one.resolve() == other.resolve()
