"""Choose the packages that one image needs from `requirements.lock`; this module only converts text.

For every package, the lock names the packages that require it (`# via`). So the part for an image can be
found without an index. Markers are evaluated for the image's Python version, which differs from the version
of the building machine.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from packaging.markers import Marker

PYTHON = "3.13"  # the version in Debian trixie

_PIN = re.compile(r"^(?P<name>[a-z0-9-]+)==(?P<version>[^ ;]+)(?: ; (?P<marker>.+?))? \\$")
_HASH = re.compile(r"^    --hash=(\S+?)(?: \\)?$")
_WANTED_BY = re.compile(r"^    # (?:via|  ) *([a-z0-9-]+)?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Pin:
    """One locked version; `wanted_by` names the packages that require it, including our own packages."""

    name: str
    version: str
    marker: str | None
    hashes: tuple[str, ...]
    wanted_by: frozenset[str]

    def requirement(self) -> str:
        """Return the pin as a line of a requirements file, with its hashes."""
        return " \\\n    ".join((f"{self.name}=={self.version}", *(f"--hash={each}" for each in self.hashes)))


def parse(lock: str) -> tuple[Pin, ...]:
    """Return the pins of a lock as `uv pip compile --generate-hashes` writes it.

    Raises:
        ValueError: a line is not of that form.
    """
    blocks: list[list[str]] = []
    for line in lock.splitlines():
        if line.startswith("    ") and blocks:
            blocks[-1].append(line)
        elif line and not line.startswith("#"):
            blocks.append([line])
    return tuple(_pin(block) for block in blocks)


def share(pins: Iterable[Pin], packages: Collection[str], machine: str, without: Collection[str] = ()) -> str:
    """Return the requirements file of everything that `packages` need on Linux and a `machine` (x86_64).

    Packages named in `without`, and packages that only these need, are left out.
    """
    here = [pin for pin in pins if _applies(pin, machine) and pin.name not in without]
    needed = set(packages)
    while more := {pin.name for pin in here if pin.wanted_by & needed} - needed:
        needed |= more
    chosen = sorted((pin for pin in here if pin.name in needed), key=lambda pin: pin.name)
    return "".join(f"{pin.requirement()}\n" for pin in chosen)


def unwanted(pins: Iterable[Pin], package: str, names: Collection[str]) -> tuple[Pin, ...]:
    """Return the pins without the requirements of `package` for the packages in `names`."""
    return tuple(
        replace(pin, wanted_by=pin.wanted_by - {package}) if pin.name in names else pin for pin in pins
    )


def _pin(block: list[str]) -> Pin:
    head = _PIN.match(block[0])
    if head is None:
        raise ValueError(f"{block[0]!r} has no version with hashes; repeat `make lock`")
    return Pin(
        name=head["name"],
        version=head["version"],
        marker=head["marker"],
        hashes=tuple(found[1] for line in block[1:] if (found := _HASH.match(line))),
        wanted_by=frozenset(found[1] for line in block[1:] if (found := _WANTED_BY.match(line)) and found[1]),
    )


def _applies(pin: Pin, machine: str) -> bool:
    return pin.marker is None or Marker(pin.marker).evaluate(environment=dict(_environment(machine)))


def _environment(machine: str) -> Mapping[str, str]:
    return {
        "python_version": PYTHON,
        "python_full_version": f"{PYTHON}.0",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
        "os_name": "posix",
        "sys_platform": "linux",
        "platform_system": "Linux",
        "platform_machine": machine,
    }
