"""Generate the MJCF world of one simulator: its source world with a generated ROS name.

Only the text `controllerArgs` changes, or is inserted after `<mujoco>`: `--name=` is set, `--synchronize` is
added, and at most one simulator keeps `--clock`. All other bytes are unchanged, as in a `.wbt` world.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final
from xml.sax.saxutils import escape

from palaestra_sim.world.mjcf.checks import checked
from palaestra_sim.world.mjcf.description import ARGUMENTS, Description, describe
from palaestra_sim.world.mjcf.elements import start_tag_end, value_span
from palaestra_sim.world.names import MAX_NAME_BYTES, RunIdentity, ros_name
from palaestra_sim.world.robots import CLOCK, NAME, SYNCHRONIZE, WorldRobot

_QUOTE: Final = {'"': "&quot;"}


def generate(
    source: bytes,
    identity: RunIdentity,
    *,
    clock: bool,
    name: str = "world",
    relative_addresses: bool = False,
) -> bytes:
    """Return the world of one simulator; the parameters are the same as for `world.generate`.

    Raises:
        WorldError: see `check`.
    """
    found = checked(source, name, relative_addresses=relative_addresses)
    return _named(found, ros_name(identity, found.robot), clock=clock)


def rename(source: bytes, suffix: str, *, name: str = "world", relative_addresses: bool = False) -> bytes:
    """Return the world with `suffix` appended to its ROS name, and without `--clock`.

    Raises:
        WorldError: see `check`; or the robot has no ROS name, or its new name is too long.
    """
    found = checked(source, name, relative_addresses=relative_addresses)
    present = _robot(found).ros_name
    at = found.texts[ARGUMENTS].start if ARGUMENTS in found.texts else found.root.start
    if not present:
        fact = f'the robot "{found.robot}" has no ROS name'
        remedy = f'add <text name="{ARGUMENTS}" data="--name=..."/> to <custom>'
        raise found.source.error(at, fact, remedy)
    if len((present + suffix).encode()) > MAX_NAME_BYTES:
        fact = f"the ROS name {present}{suffix} has more than {MAX_NAME_BYTES} bytes"
        raise found.source.error(at, fact, f"shorten the name in {ARGUMENTS}")
    return _named(found, present + suffix, clock=False)


def robots(source: bytes, name: str = "world") -> tuple[WorldRobot, ...]:
    """Return the robot of a world; a world has exactly one robot, which is a supervisor.

    Raises:
        WorldError: the bytes are not an MJCF world.
    """
    return (_robot(describe(source, name)),)


def _robot(found: Description) -> WorldRobot:
    names = [it.removeprefix(NAME) for it in found.arguments if it.startswith(NAME)]
    return WorldRobot(
        robot=found.robot,
        ros_name=names[-1] if names else None,
        supervisor=True,
        synchronize=SYNCHRONIZE in found.arguments,
    )


def _named(found: Description, new: str, *, clock: bool) -> bytes:
    """Return a world whose robot has the name `new`."""
    arguments = _arguments(found.arguments, new, clock=clock)
    element = found.texts.get(ARGUMENTS)
    data = found.source.data
    value = b'"' + escape(" ".join(arguments), _QUOTE).encode() + b'"'
    if element is None:
        start = end = start_tag_end(found.source, found.root)
        text = f'<custom><text name="{ARGUMENTS}" data='.encode() + value + b"/></custom>"
    else:
        start, end = value_span(found.source, element, "data")
        text = data[start:end] if tuple(arguments) == found.arguments else value
    result = data[:start] + text + data[end:]
    if describe(result, found.source.name).arguments != tuple(arguments):
        fact = f"the generated world lacks the arguments {' '.join(arguments)}"
        raise found.source.error(start, fact, "report this world; the generator has a bug")
    return result


def _arguments(present: Iterable[str], new: str, *, clock: bool) -> list[str]:
    """Return the arguments with one `--name=` and one `--synchronize`; `clock` allows one `--clock`."""
    arguments: list[str] = []
    once = {NAME + new, SYNCHRONIZE, CLOCK}
    written = set() if clock else {CLOCK}
    for argument in present:
        wanted = NAME + new if argument.startswith(NAME) else argument
        if wanted not in written:
            arguments.append(wanted)
        if wanted in once:
            written.add(wanted)
    if NAME + new not in arguments:
        arguments.insert(0, NAME + new)
    if SYNCHRONIZE not in arguments:
        arguments.insert(arguments.index(NAME + new) + 1, SYNCHRONIZE)
    return arguments
