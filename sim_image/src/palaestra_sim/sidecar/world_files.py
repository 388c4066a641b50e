"""Write the world that the simulator will run, into a folder in which the simulator finds all other files.

The source is a world of the image or of the replica's ConfigMap. Only the sidecar changes the ROS names in a
world.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from palaestra_protocol.control import RobotName
from palaestra_protocol.whole_file import write_whole
from palaestra_sim.errors import RootError, SidecarError, WorldError
from palaestra_sim.sidecar import project
from palaestra_sim.world import MJCF, RunIdentity, builtin_path, generate, placed, rename, robots, suffix
from palaestra_sim.world import root_of as root_around
from palaestra_sim.world.bounded_read import read_bounded

SLOTS = ("a", "b")  # the simulators of one sidecar: the first, and its standby
_PROJECT = "project"


def located(world: str) -> Path:
    """Return the path of a world: the file `world`; if it is missing, the shipped world of that name.

    A folder with the name of a shipped world is ignored.
    """
    path = Path(world)
    missing = path.is_dir() or not path.exists()
    shipped = builtin_path(world) if path.name == world and missing else None
    return shipped or path


def read(world: Path) -> bytes:
    """Return the bytes of a world.

    Raises:
        SidecarError: the file does not exist, or cannot be read.
    """
    try:
        return read_bounded(world)
    except OSError as error:
        raise SidecarError(f"--world: {world}: {error.strerror}; give a .wbt or .xml file") from error


def named(
    world: Path,
    work: Path,
    identity: RunIdentity,
    *,
    clock: bool,
    as_project: bool = False,
    root: Path | None = None,
) -> Path:
    """Generate this simulator's world from `world`, write it into the folder `work`, and return its path.

    With `as_project`, or if the world names files by relative paths, the result is a Webots project in
    `work`, with links to the files around `world`. These are the files in all folders from the folder of
    `world` up to `root`. If `root` is None, the function uses the nearest folder that holds all files that
    the world names.

    Raises:
        WorldError: the world is wrong.
        SidecarError: the world cannot be read or written; no partial file is left.
    """
    source = read(world)
    make = partial(generate, source, identity, clock=clock, name=str(world))
    path = work / file_name(identity, suffix(source))
    return _written(world, path, make, as_project=as_project, root=root)


def renamed(
    world: Path, work: Path, ending: str, *, as_project: bool = False, root: Path | None = None
) -> Path:
    """Write into `work` a copy of `world` with `ending` appended to its ROS names; return its path.

    `as_project` and `root` have the same meaning as in `named`.

    Raises:
        WorldError, SidecarError: see `named`.
    """
    source = read(world)
    make = partial(rename, source, ending, name=str(world))
    path = work / f"{world.stem}{ending}{suffix(source)}"
    return _written(world, path, make, as_project=as_project, root=root)


def root_of(world: Path, given: Path | None) -> Path:
    """Return the folder that holds `world` and all files that it names: `given`, or the nearest such folder.

    Raises:
        WorldError, SidecarError: see `named`.
    """
    try:
        return root_around(placed(world), read(world), given)
    except RootError as error:
        raise SidecarError(f"--root: {error}") from error
    except OSError as error:
        raise SidecarError(f"--world: {error.filename}: {error.strerror}; make it readable") from error


def root_of_model(world: Path, given: Path | None) -> Path | None:
    """Return the result of `root_of` for an MJCF model; None for any other world, which needs no root.

    Raises:
        WorldError, SidecarError: see `named`.
    """
    return root_of(world, given) if suffix(read(world)) == MJCF else None


def _written(
    world: Path, path: Path, make: Callable[..., bytes], *, as_project: bool, root: Path | None
) -> Path:
    """Write the world that `make` returns to `path`, or into a project in the folder of `path`."""
    source, work = placed(world), path.parent
    try:
        generated, linked = make(), as_project and project.has_project(source)
    except WorldError:
        generated, linked = make(relative_addresses=True), True
    try:
        if as_project or linked:
            around = root_of(world, root)
            path = project.lay_out(source, work / _PROJECT, around, linked=linked) / path.name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, generated)
    except OSError as error:
        raise SidecarError(f"--work: {work}: {error.strerror}; give a writable folder with space") from error
    return path


def file_name(identity: RunIdentity, ending: str = ".wbt") -> str:
    """Return the file name of a simulator's world: `collect-0.wbt`, or `collect-0b.wbt` for its standby."""
    slot = "" if identity.slot == SLOTS[0] else identity.slot
    return f"{identity.group}-{identity.index}{slot}{ending}"


def described(source: bytes, name: str) -> tuple[RobotName, ...]:
    """Return the robots of a world that have a ROS name, so that clients can find them.

    Raises:
        WorldError: the world is wrong.
    """
    return tuple(
        RobotName(
            robot=robot.robot,
            ros_name=robot.ros_name,
            supervisor=robot.supervisor,
            definition=robot.definition,
        )
        for robot in robots(source, name)
        if robot.ros_name
    )
