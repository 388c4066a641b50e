"""Checks for worlds that can be parsed, but from which no simulator's world can be generated.

Each check finds one kind of mistake, at every position in the file. One error lists all mistakes, in the
order of the file. No check depends on the simulator, so a world that passes once passes for every simulator.
"""

import re
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.world.reader import parse
from palaestra_sim.world.robots import robot_name, ros_robots
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, glance, unquoted
from palaestra_sim.world.tree import Node, Value, World

_ADDRESS_FIELD = re.compile(r"(?:url|sound|texture)\Z", re.IGNORECASE)
_ABSOLUTE = re.compile(r"[a-z][a-z0-9+.-]*://|/", re.IGNORECASE)
_MOST_NAMED = 20  # maximum number of robots that an error lists
_ROS_REMAPPING = re.compile(r"__\w+:=")


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A world for which names will be generated, and its ROS robots."""

    source: Source
    world: World
    robots: Sequence[Node]


Check = Callable[[Candidate], Iterator[WorldError]]


def no_robot_speaks_ros(candidate: Candidate) -> Iterator[WorldError]:
    """No robot has the controller "ros", so a trainer can reach no robot of this world."""
    if candidate.robots:
        return
    others = [node for node in candidate.world.walk() if _is_robot(node)]
    if not others:
        fact = "the world has no robot"
        yield candidate.source.error(0, fact, 'add one with controller "ros" and supervisor TRUE')
        return
    named = ", ".join(
        f'"{robot_name(robot)}" (controller "{_controller(robot)}")' for robot in islice(others, _MOST_NAMED)
    )
    more = f" and {len(others) - _MOST_NAMED} others" if len(others) > _MOST_NAMED else ""
    fact = f'no robot has the controller "ros": there are {named}{more}'
    remedy = 'set controller "ros" on the robots to be trained, and supervisor TRUE on one of them'
    yield candidate.source.error(others[0].span[0], fact, remedy)


def robot_used_twice(candidate: Candidate) -> Iterator[WorldError]:
    """A `USE` repeats a robot with the same ROS name.

    A `USE` refers only to the last DEF of that name before it, but this check compares all DEFs of that name.
    So it also refuses some valid worlds; with different DEF names, these worlds are clearer.
    """
    starts = [robot.span[0] for robot in candidate.robots]
    containers = {}
    for node in candidate.world.walk():
        # A robot that begins inside a node is part of that node. If a node contains several robots, the error
        # names the last one.
        last = bisect_left(starts, node.span[1]) - 1
        if node.def_name is not None and last >= 0 and starts[last] >= node.span[0]:
            containers[node.def_name] = candidate.robots[last]
    for node in candidate.world.walk():
        if node.uses in containers:
            robot = glance(robot_name(containers[node.uses]))
            fact = f'USE {node.uses} repeats the robot "{robot}" and its ROS name'
            yield candidate.source.error(node.span[0], fact, "write the node out, with another name")


def robots_of_one_name(candidate: Candidate) -> Iterator[WorldError]:
    """Two robots have the same Robot.name, which clients use to find them and which determines ROS names."""
    seen = set()
    for robot in candidate.robots:
        name = robot_name(robot)
        if name in seen:
            fact = f'a second robot is called "{name}"'
            yield candidate.source.error(robot.span[0], fact, "give it another name")
        seen.add(name)


def arguments_that_are_no_strings(candidate: Candidate) -> Iterator[WorldError]:
    """An argument is not a string, so it was probably meant for another field."""
    for value in _argument_values(candidate):
        for token in candidate.world.inside(value):
            if token.kind != "string" and token.text not in (b"[", b"]"):
                fact = f"{token.text.decode()} in controllerArgs is not a string"
                yield candidate.source.error(token.start, fact, 'write a list like ["--clock"]')


def renamed_behind_its_name(candidate: Candidate) -> Iterator[WorldError]:
    """A ROS remapping such as `__name:=x` would overrule the generated name of the robot."""
    for value in _argument_values(candidate):
        for token in _strings(candidate.world, value):
            if _ROS_REMAPPING.match(unquoted(token)):
                fact = f"{token.text.decode()} overrides the generated ROS name"
                yield candidate.source.error(token.start, fact, "remove it")


def relative_address(candidate: Candidate) -> Iterator[WorldError]:
    """An address is relative, but the world is not in a file, so it has no folder."""
    for token in _addresses(candidate.world):
        if not _ABSOLUTE.match(unquoted(token)):
            fact = (
                f"{token.text.decode()} is relative to the file of the world, and this world is not in a file"
            )
            remedy = "begin the address with webots:// or https://, or give the world as a file"
            yield candidate.source.error(token.start, fact, remedy)


def relative_addresses(source: bytes, name: str) -> tuple[str, ...]:
    """Return the addresses in a world that are relative to its folder.

    Raises:
        WorldError: the world cannot be read.
    """
    addresses = map(unquoted, _addresses(parse(source, name)))
    return tuple(address for address in addresses if not _ABSOLUTE.match(address))


def _is_robot(node: Node) -> bool:
    return node.type_name == "Robot" or "controller" in node.fields


def _controller(robot: Node) -> str:
    """Return the controller of a robot; the default of a Robot is "<generic>" in Webots."""
    return robot.text("controller") or "<generic>"


def _argument_values(candidate: Candidate) -> Iterator[Value]:
    """Yield the controllerArgs of every robot that has them."""
    for robot in candidate.robots:
        if "controllerArgs" in robot.fields:
            yield robot.fields["controllerArgs"]


def _addresses(world: World) -> Iterator[Token]:
    """Yield the tokens of all strings that are addresses.

    A texture without a dot is the name of a built-in texture of Webots, such as "mountains".
    """
    yield from world.externs
    for node in world.walk():
        for field, value in node.fields.items():
            if _ADDRESS_FIELD.search(field):
                named = field.lower().endswith("texture")
                for token in _strings(world, value):
                    if b"." in token.text or not named:
                        yield token


def _strings(world: World, value: Value) -> Iterator[Token]:
    """Yield the tokens of the non-empty strings of a value."""
    return (token for token in world.inside(value) if token.kind == "string" and token.text != b'""')


CHECKS: tuple[Check, ...] = (
    no_robot_speaks_ros,
    robot_used_twice,
    robots_of_one_name,
    arguments_that_are_no_strings,
    renamed_behind_its_name,
)
"""The checks for every world."""

CHECKS_WITHOUT_FILE: tuple[Check, ...] = (*CHECKS, relative_address)
"""The checks for a world without a file; such a world cannot use relative addresses."""


def candidate(source: bytes, name: str, *, relative_addresses: bool) -> Candidate:
    """Return a world that passes every check.

    Raises:
        WorldError: see `check`.
    """
    world = parse(source, name)
    found = Candidate(source=Source(data=source, name=name), world=world, robots=ros_robots(world))
    checks = CHECKS if relative_addresses else CHECKS_WITHOUT_FILE
    if error := refusal(chain.from_iterable(check(found) for check in checks)):
        raise error
    return found


def check(source: bytes, name: str = "world", *, relative_addresses: bool = False) -> None:
    """Check that a world can be generated from the world `source` for every simulator.

    `name` is the name of the world in errors. `relative_addresses` is True if the world stays next to the
    files that it names, so that it may use relative addresses.

    Raises:
        WorldError: the world cannot be read, or a check of this module fails.
    """
    candidate(source, name, relative_addresses=relative_addresses)
