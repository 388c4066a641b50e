"""Generate the world of one simulator: its source world with generated ROS names.

Only the `controllerArgs` of robots whose controller is "ros" change, and only these arguments:

    --name=          the robot's ROS name; added if it is missing, and never twice
    --synchronize    added, so that the simulation waits for its client to step it
    --clock          never added. With `clock`, the first one of the world stays and the others
                     are removed; without `clock`, all are removed. Two simulators with --clock
                     on one ROS master would publish two different times on one topic.

All other bytes are unchanged. Generation from a generated world gives the same world again.
"""

from collections.abc import Sequence

from palaestra_sim.world.arguments import argument_edits, asks_for_clock
from palaestra_sim.world.checks import Candidate, candidate
from palaestra_sim.world.names import MAX_NAME_BYTES, RunIdentity, ros_name
from palaestra_sim.world.patches import edited
from palaestra_sim.world.robots import described, robot_name
from palaestra_sim.world.tree import Node


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
    found = candidate(source, name, relative_addresses=relative_addresses)
    names = [ros_name(identity, robot_name(robot)) for robot in found.robots]
    return _named(found, names, clock=clock)


def rename(source: bytes, suffix: str, *, name: str = "world", relative_addresses: bool = False) -> bytes:
    """Return the world with `suffix` appended to each of its ROS names, and without any `--clock`.

    Use this world for a second simulator on the same ROS master. See `check` for `name` and
    `relative_addresses`.

    Raises:
        WorldError: see `check`; or a robot has no ROS name, or its new name is too long.
    """
    found = candidate(source, name, relative_addresses=relative_addresses)
    return _named(found, [_longer(found, robot, suffix) for robot in found.robots], clock=False)


def _longer(found: Candidate, robot: Node, suffix: str) -> str:
    present = described(robot).ros_name
    if not present:
        fact = f'the robot "{robot_name(robot)}" has no ROS name'
        raise found.source.error(robot.span[0], fact, 'add "--name=..." to its controllerArgs')
    if len((present + suffix).encode()) > MAX_NAME_BYTES:
        fact = f"the ROS name {present}{suffix} has more than {MAX_NAME_BYTES} bytes"
        raise found.source.error(robot.span[0], fact, "shorten the name in controllerArgs")
    return present + suffix


def _named(found: Candidate, names: Sequence[str], *, clock: bool) -> bytes:
    """Return a world whose robots have `names`, one for each in source order."""
    timekeeper = next(filter(asks_for_clock, found.robots), None) if clock else None
    edits = [
        edit
        for robot, new in zip(found.robots, names, strict=True)
        for edit in argument_edits(found.world, robot, new, clock=robot is timekeeper)
    ]
    return edited(found.source, found.world.tokens, sorted(edits, key=lambda edit: edit.start))
