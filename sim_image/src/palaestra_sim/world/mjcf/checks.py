"""Checks for MJCF worlds that are valid XML, but from which no simulator's world can be generated.

Each check finds one kind of mistake, at every position in the file, like the checks of `.wbt` worlds.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import chain
from typing import Final

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.world.mjcf.description import (
    BASIC_STEP,
    DEVICE,
    DEVICE_KINDS,
    Description,
    custom,
    describe,
    fits,
    fitting_timesteps_s,
    whole_step_ms,
)
from palaestra_sim.world.mjcf.files import absolutes, named_files, parts
from palaestra_sim.world.mjcf.size_checks import growing
from palaestra_sim.world.paths import is_relative

_ROS_REMAPPING: Final = re.compile(r"__\w+:=")

Check = Callable[[Description], Iterator[WorldError]]


def no_actuator(found: Description) -> Iterator[WorldError]:
    """The model has no actuator, and includes no other file that might have one."""
    if not any(it.children for it in found.root.named("actuator")) and not parts(found.root):
        fact = "the model has no actuator, so a trainer cannot move anything"
        yield found.source.error(found.root.start, fact, "add <actuator> with a motor, position or velocity")


def repeated(found: Description) -> Iterator[WorldError]:
    """Two elements `text` or `numeric` have the same name, so MuJoCo refuses the model."""
    for tag in ("text", "numeric"):
        seen = set()
        for name, element in custom(found.root, tag):
            if name in seen:
                yield found.source.error(element.start, f"a second {tag} is called {name!r}", "remove one")
            seen.add(name)


def without_data(found: Description) -> Iterator[WorldError]:
    """An element `text` or `numeric` has no data, or no name."""
    for tag in ("text", "numeric"):
        for element in found.root.named("custom", tag):
            if not element.attributes.get("name") or not element.attributes.get("data", "").strip():
                fact = f"a {tag} in <custom> has no {'name' if element.attributes.get('data') else 'data'}"
                yield found.source.error(element.start, fact, "write both")


def renamed_behind_its_name(found: Description) -> Iterator[WorldError]:
    """A ROS remapping such as `__name:=x` would overrule the generated name of the robot."""
    for argument in found.arguments:
        if _ROS_REMAPPING.match(argument):
            element = found.texts["controllerArgs"]
            fact = f"{argument} in controllerArgs overrides the generated ROS name"
            yield found.source.error(element.start, fact, "remove it")


def unfit_step(found: Description) -> Iterator[WorldError]:
    """The basic step is not a whole number of milliseconds, or not a whole number of MuJoCo's steps.

    If the model includes other files, they may set the timestep. Then this check finds nothing, and the
    loader checks the model that MuJoCo has compiled.
    """
    if parts(found.root):
        return
    timestep_s, step_ms = found.timestep_s, found.basic_step_ms
    element = found.numbers.get(BASIC_STEP)
    if not timestep_s > 0.0:
        option = next(found.root.named("option"))
        yield found.source.error(option.start, "the timestep is not a positive number", "write seconds")
    elif step_ms is None or element is None:
        if whole_step_ms(timestep_s) is None:
            fact = f"no short basic step of whole milliseconds fits the timestep of {timestep_s:g} s"
            shorter, longer = fitting_timesteps_s(timestep_s)
            option = next(found.root.named("option"))
            yield found.source.error(option.start, fact, f"write {shorter:g} or {longer:g}")
    elif not fits(step_ms, timestep_s):
        fact = f"basicTimeStep {step_ms:g} is not a multiple of the timestep of {timestep_s:g} s in whole ms"
        yield found.source.error(element.start, fact, f"write {whole_step_ms(timestep_s) or 'another'}")


def unknown_devices(found: Description) -> Iterator[WorldError]:
    """An element `text` that renames a device has a name in a wrong form, or gives no new name."""
    for key, name in found.devices.items():
        kind, slash, old = key.partition("/")
        if kind not in DEVICE_KINDS or not slash or not old or not name:
            kinds = ", ".join(DEVICE_KINDS)
            remedy = f'write "{DEVICE}KIND/NAME" with a KIND of {kinds}, and the new name or "-" as data'
            yield found.source.error(
                found.texts[DEVICE + key].start, f"{DEVICE + key!r} does not name a device", remedy
            )


def too_large(found: Description) -> Iterator[WorldError]:
    """MuJoCo would need too much memory to read an element."""
    yield from growing(found.source, found.root)


def absolute_path(found: Description) -> Iterator[WorldError]:
    """The name of a file is not relative to the folder of the world."""
    yield from absolutes(found.source, found.root)


def relative_address(found: Description) -> Iterator[WorldError]:
    """The model names a file, but the world is not in a file, so it has no folder."""
    for element, path in named_files(found.root):
        if is_relative(path):
            fact = f"{path!r} is relative to the file of the world, and this world is not in a file"
            yield found.source.error(element.start, fact, "give the world as a file (world.file)")


CHECKS: Final[tuple[Check, ...]] = (
    no_actuator,
    repeated,
    without_data,
    renamed_behind_its_name,
    unfit_step,
    unknown_devices,
    too_large,
    absolute_path,
)
"""The checks for every MJCF world."""

CHECKS_WITHOUT_FILE: Final[tuple[Check, ...]] = (*CHECKS, relative_address)
"""The checks for a world without a file; such a world cannot use relative addresses."""


def checked(source: bytes, name: str = "world", *, relative_addresses: bool) -> Description:
    """Return the description of a world that passes every check.

    Raises:
        WorldError: see `check`.
    """
    found = describe(source, name)
    checks = CHECKS if relative_addresses else CHECKS_WITHOUT_FILE
    if error := refusal(chain.from_iterable(check(found) for check in checks)):
        raise error
    return found


def check(source: bytes, name: str = "world", *, relative_addresses: bool = False) -> None:
    """Check that a world can be generated from the MJCF world `source` for every simulator.

    `name` is the name of the world in errors. `relative_addresses` is True if the world stays next to the
    files that it names.

    Raises:
        WorldError: the world cannot be read, or a check of this module fails.
    """
    checked(source, name, relative_addresses=relative_addresses)
