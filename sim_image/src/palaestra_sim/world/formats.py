"""The two formats of worlds: `.wbt`, and MJCF, which begins with `<`.

A world may come without a file name, so its first byte decides its format. The modules of this package handle
`.wbt` worlds; the package `mjcf` handles MJCF worlds.
"""

from palaestra_sim.world import mjcf
from palaestra_sim.world.checks import check as check_wbt
from palaestra_sim.world.generate import generate as generate_wbt
from palaestra_sim.world.generate import rename as rename_wbt
from palaestra_sim.world.names import RunIdentity
from palaestra_sim.world.robots import WorldRobot
from palaestra_sim.world.robots import own_controllers as own_controllers_wbt
from palaestra_sim.world.robots import robots as robots_wbt

MJCF = ".xml"
WBT = ".wbt"


def suffix(source: bytes) -> str:
    """Return the suffix of the file name for a world with these bytes: ".wbt" or ".xml"."""
    return MJCF if mjcf.is_mjcf(source) else WBT


def check(source: bytes, name: str = "world", *, relative_addresses: bool = False) -> None:
    """Check that a world can be generated from the world `source` for every simulator.

    `name` is the name of the world in errors. `relative_addresses` is True if the world stays next to the
    files that it names, so that it may use relative addresses.

    Raises:
        WorldError: the world cannot be read, or a check fails.
    """
    checking = mjcf.check if mjcf.is_mjcf(source) else check_wbt
    checking(source, name, relative_addresses=relative_addresses)


def generate(
    source: bytes,
    identity: RunIdentity,
    *,
    clock: bool,
    name: str = "world",
    relative_addresses: bool = False,
) -> bytes:
    """Return the world of one simulator, generated from the world `source`.

    `clock` is True if this simulator may publish `/clock` when its world requests it. `clock` must be True
    for at most one simulator of a ROS master. See `check` for `name` and `relative_addresses`.

    Raises:
        WorldError: see `check`.
    """
    generator = mjcf.generate if mjcf.is_mjcf(source) else generate_wbt
    return generator(source, identity, clock=clock, name=name, relative_addresses=relative_addresses)


def rename(source: bytes, ending: str, *, name: str = "world", relative_addresses: bool = False) -> bytes:
    """Return the world with `ending` appended to each of its ROS names, and without any `--clock`.

    Use this world for a second simulator on the same ROS master. See `check` for `name` and
    `relative_addresses`.

    Raises:
        WorldError: see `check`; or a robot has no ROS name, or its new name is too long.
    """
    renamer = mjcf.rename if mjcf.is_mjcf(source) else rename_wbt
    return renamer(source, ending, name=name, relative_addresses=relative_addresses)


def robots(source: bytes, name: str = "world") -> tuple[WorldRobot, ...]:
    """Return every robot of a world whose controller is "ros", in source order.

    Raises:
        WorldError: the bytes are not a world file.
    """
    return mjcf.robots(source, name) if mjcf.is_mjcf(source) else robots_wbt(source, name)


def own_controllers(source: bytes, name: str = "world") -> tuple[tuple[str, str], ...]:
    """Return (robot, controller) for each robot whose controller is a program of the world's project.

    Raises:
        WorldError: the bytes are not a world file.
    """
    return () if mjcf.is_mjcf(source) else own_controllers_wbt(source, name)
