"""Put the world that the simulator will run where it can run it.

The sidecar alone writes names into a world: it is given a source world, of the image or of the
replica's ConfigMap. ConfigMaps of older releases hold a world for each simulator with its names in it;
the generator makes the same world of what it has made before.
"""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from palaestra_sim.errors import WorldError
from palaestra_sim.protocol.control import RobotName
from palaestra_sim.sidecar.errors import SidecarError
from palaestra_sim.world import RunIdentity, builtin_path, generate, rename, robots

SLOTS = ("a", "b")  # of the simulators of one sidecar: the first, and one that may stand by for it
_PROJECT = "project"


def located(world: str) -> Path:
    """Return the path of a world: a file, or else the one that ships under that name."""
    path = Path(world)
    shipped = builtin_path(world) if path.name == world and not path.exists() else None
    return shipped or path


def read(world: Path) -> bytes:
    """Return the bytes of a world.

    Raises:
        SidecarError: there is no such file, or it may not be read.
    """
    try:
        return world.read_bytes()
    except OSError as error:
        raise SidecarError(f"--world: {world}: {error.strerror}; give a .wbt file") from error


def named(world: Path, work: Path, identity: RunIdentity, *, clock: bool) -> Path:
    """Write this simulator's own world of `world` into the folder `work`; return where it is.

    A world that names files beside it gets them, as links, at the same places around its new one.

    Raises:
        WorldError: the world is wrong.
        SidecarError: it cannot be read or written; nothing is half-written.
    """
    make = partial(generate, read(world), identity, clock=clock, name=str(world))
    return _written(world, work, file_name(identity), make)


def renamed(world: Path, work: Path, suffix: str) -> Path:
    """Write a copy of `world` with `suffix` behind its ROS names into the folder `work`; return where it is.

    Raises:
        WorldError, SidecarError: as `named` does.
    """
    make = partial(rename, read(world), suffix, name=str(world))
    return _written(world, work, f"{world.stem}{suffix}.wbt", make)


def _written(world: Path, work: Path, name: str, make: Callable[..., bytes]) -> Path:
    """Write what `make` makes of `world`, with the files around it if it names some."""
    try:
        generated, folder = make(), None
    except WorldError:
        generated = make(relative_addresses=True)
        folder = work / _PROJECT / (world.absolute().parent.name or "worlds")
    try:
        if folder is not None:
            _link_neighbours(world.absolute(), folder)
        return _write_whole((folder or work) / name, generated)
    except OSError as error:
        raise SidecarError(f"--work: {work}: {error.strerror}; give a folder with room") from error


def file_name(identity: RunIdentity) -> str:
    """Return the name of a simulator's own world: `collect-0.wbt`, `collect-0b.wbt` for its standby."""
    slot = "" if identity.slot == SLOTS[0] else identity.slot
    return f"{identity.group}-{identity.index}{slot}.wbt"


def described(source: bytes, name: str) -> tuple[RobotName, ...]:
    """Return the robots of a world that a client can find: those with a ROS name in it.

    Raises:
        WorldError: the world is wrong.
    """
    return tuple(
        RobotName(robot=robot.robot, ros_name=robot.ros_name, supervisor=robot.supervisor)
        for robot in robots(source, name)
        if robot.ros_name
    )


def _link_neighbours(world: Path, folder: Path) -> None:
    """Make what lies beside `world`, and beside its folder, lie around `folder` in the same way.

    That is how far a Webots project's addresses go: `textures/a.png`, `../protos/Robot.proto`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for neighbour in world.parent.parent.iterdir():
        if neighbour != world.parent:
            _link(folder.parent / neighbour.name, neighbour)
    for neighbour in world.parent.iterdir():
        _link(folder / neighbour.name, neighbour)


def _link(link: Path, target: Path) -> None:
    if link.is_symlink():
        link.unlink()  # of an earlier life of this container
    link.symlink_to(target)


def _write_whole(path: Path, content: bytes) -> Path:
    """Write a file so that it is there as a whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path
