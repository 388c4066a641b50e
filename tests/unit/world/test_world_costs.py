"""The time to read a world is proportional to its size, whatever the world contains.

An operator reads worlds of people who may want to keep it busy. Each test reads a world of one size and a
world of four times that size. A quadratic time would be sixteen times as long.
"""

import gc
import time
from collections.abc import Callable
from contextlib import suppress

import pytest

from palaestra_sim.world import RunIdentity, WorldError, check, generate

SMALL, GROWTH = 32 << 10, 4
MOST = 2.5  # On a busy machine, the large world may take this many times longer than proportional.
TRIES = 4
HEADER = b"#VRML_SIM R2023b utf8\n"
ROBOT = b'Robot{controller "ros"}'
IDENTITY = RunIdentity(job="job", replica=0, group="collect", index=0)

Shape = Callable[[int], bytes]


def filled(head: bytes, unit: bytes, tail: bytes = b"", first: bytes = HEADER + ROBOT) -> Shape:
    """Return a function that builds a world of a given size: `unit`, repeated between a head and a tail."""

    def shape(size: int) -> bytes:
        room = size - len(first) - len(head) - len(tail)
        return first + head + unit * (room // len(unit)) + tail

    return shape


def numbered(head: bytes, unit: str, tail: bytes = b"", first: bytes = HEADER) -> Shape:
    """Return a function that builds a world of a given size: `unit` with a new number at each repetition."""

    def shape(size: int) -> bytes:
        count = (size - len(first) - len(head) - len(tail)) // (len(unit) + 2)
        return first + head + b"".join((unit % index).encode() for index in range(count)) + tail

    return shape


def halves(first: Shape, second: Shape) -> Shape:
    """Return a function that builds a world from two others, each for one half of the size."""
    return lambda size: first(size // 2) + second(size // 2).removeprefix(HEADER)


def model(head: bytes, unit: bytes, tail: bytes = b"") -> Shape:
    """Return a function that builds an MJCF model of a given size from repetitions of `unit`."""
    return filled(b"<mujoco><actuator><motor/></actuator>" + head, unit, tail + b"</mujoco>", first=b"  \n")


def several(head: str, unit: str, tail: str) -> Shape:
    """Return a function that builds an MJCF model from repetitions of `unit` with a new number each."""
    root = b"<mujoco><actuator><motor/></actuator>"
    return numbered(head.encode(), unit, tail.encode() + b"</mujoco>", first=root)


SHAPES: dict[str, Shape] = {
    "nodes": filled(b"", b"A{}"),
    "lines": filled(b"", b"A{}\n"),
    "deep nodes": filled(b"", b"A{a A{a A{a A{a A{a A{}}}}}}"),
    "nested without end": filled(b"", b"A{a "),
    "lists nested without end": filled(b"", b"A{a["),
    "robots of other names": numbered(b"", 'R{controller "ros" name "%x"}'),
    "robots of one name": filled(b"", b'R{controller "ros"}', first=HEADER),
    "robots of one long name": lambda size: filled(
        b'DEF a R{controller "ros" name "' + b"n" * (size // 2) + b'"}', b"USE a ", first=HEADER
    )(size),
    "robots that speak no ROS": filled(b"", b'R{controller "void"}', first=HEADER),
    "DEF beside robots": halves(filled(b"", b"DEF a A{}"), numbered(b"", 'R{controller "ros" name "%x"}')),
    "other DEF": numbered(b"", "DEF a%x A{}", first=HEADER + ROBOT),
    "USE of a robot": filled(b'DEF a R{controller "ros"}', b"USE a ", first=HEADER),
    "USE": filled(b"A{a[", b"USE a ", b"]}"),
    "numbers": filled(b"A{a[", b"0 ", b"]}"),
    "numbers without a list": filled(b"A{a ", b"0 ", b"}"),
    "one long number": filled(b"A{a ", b"9", b"}"),
    "one long fraction": filled(b"A{a 0.", b"1", b"}"),
    "one long number that is none": filled(b"A{a ", b"9", b"x}"),
    "one long name": filled(b"A{a ", b"x", b"{}}"),
    "strings": filled(b"A{a[", b'"" ', b"]}"),
    "one long string": filled(b'A{a "', b"\xf0\x9f\x98\x80", b'"}'),
    "one long string of escapes": filled(b'A{a "', b'\\"', b'"}'),
    "a string that is not closed": filled(b'A{a "', b'\\"'),
    "fields": numbered(b"A{", "f%x 0 ", b"}", first=HEADER + ROBOT),
    "comments": filled(b"", b"#\n"),
    "one long comment": filled(b"#", b"#"),
    "commas": filled(b"", b", "),
    "arguments": filled(b'R{controller "ros" name "b" controllerArgs [', b'"--x" ', b"]}"),
    "arguments that are names": filled(
        b'R{controller "ros" name "b" controllerArgs [', b'"--name=x" ', b"]}"
    ),
    "arguments that are clocks": filled(
        b'R{controller "ros" name "b" controllerArgs [', b'"--clock" ', b"]}"
    ),
    "arguments in one string": filled(b'R{controller "ros" name "b" controllerArgs ["', b"--x ", b'"]}'),
    "arguments behind a long gap": halves(
        filled(b'R{controller "ros" name "b" controllerArgs [', b"\n"), filled(b'"', b"--x ", b'"]}', HEADER)
    ),
    "arguments that are numbers": filled(b'R{controller "ros" name "b" controllerArgs [', b"0 ", b"]}"),
    "relative addresses": filled(b"A{url[", b'"a" ', b"]}"),
    "relative addresses in lines": filled(b"A{url[", b'"a"\n', b"]}"),
    "MJCF, flat": model(b"", b"<a/>"),
    "MJCF, deep": model(b"", b"<a>" * 150 + b"</a>" * 150),
    "MJCF, nested without end": model(b"", b"<a>"),
    "MJCF, absolute files": model(b"", b'<a file="/"/>'),
    "MJCF, files in lines": model(b"", b'<a file="b"/>\n'),
    "MJCF, one long file name": model(b'<a file="', b"../", b'"/>'),
    "MJCF, one long value": model(b'<a b="', b"&amp;", b'"/>'),
    "MJCF, attributes": several("<a ", 'b%x="" ', "/>"),
    "MJCF, texts of one name": model(b"<custom>", b'<text name="a" data="b"/>', b"</custom>"),
    "MJCF, texts without data": model(b"<custom>", b"<text/>", b"</custom>"),
    "MJCF, devices": several("<custom>", '<text name="device:%x" data="b"/>', "</custom>"),
    "MJCF, arguments": model(
        b'<custom><text name="controllerArgs" data="', b"a --synchronize ", b'"/></custom>'
    ),
    "MJCF, comments": model(b"", b"<!---->"),
    "MJCF, text": model(b"", b"a\n"),
    "MJCF, not closed": model(b"<a b='", b'"'),
}


def seconds(source: bytes) -> float:
    """Return the processor time of checking a world and, if it is valid, of generating from it.

    Garbage collection is off meanwhile, because it also searches the objects of all earlier tests.
    """
    gc.disable()
    began = time.process_time()
    try:
        with suppress(WorldError):
            check(source)
            generate(source, IDENTITY, clock=False)
        return time.process_time() - began
    finally:
        gc.enable()


@pytest.mark.parametrize("unit", [b'<a file="/"/>', b'<a file="b"/>\n'])
def test_an_error_has_so_many_places_and_no_more(unit: bytes) -> None:
    """A message with 80,000 positions helps nobody, and each position takes memory."""
    with pytest.raises(WorldError, match=r"100 or more places") as caught:
        check(model(b"", unit)(SMALL))

    assert len(str(caught.value)) < 20_000


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_a_larger_world_costs_more_only_in_proportion(shape: Shape) -> None:
    """If a world of one megabyte took minutes, the operator could not serve other jobs meanwhile."""
    ratios = []
    for _ in range(TRIES):
        small = seconds(shape(SMALL))
        ratios.append(seconds(shape(SMALL * GROWTH)) / max(small, 1e-3))
        if ratios[-1] < MOST * GROWTH:
            break

    assert min(ratios) < MOST * GROWTH
