"""The errors of a simulator's container, as one tree.

    SimError
    ├── WorldError              the .wbt file is wrong: retrying cannot help
    │   └── WorldRefusedError   it has several mistakes; the message lists them all
    ├── RootError               a folder does not hold all that a world names: retrying cannot help
    ├── StandInError            a file of stand-ins is wrong: retrying cannot help
    ├── UnknownWorldError       no shipped world has that name: retrying cannot help
    ├── ForeignPackageError     the folder has another webots_ros: retrying cannot help
    ├── SidecarError            the sidecar cannot run as requested: retrying cannot help
    ├── FaultError              the description of a fault is wrong (faults.language)
    ├── NoSuchHandleError       this load of the world has no such node (front.handles)
    ├── NoValueError            a field has no such value (scene.tree)
    ├── MissingLibraryError     a simulator needs a package that is not installed (mujoco.library)
    └── UnsimulatedError        Webots does it, this simulator does not (seam)

A message names the place, the fact and the remedy.
"""

from collections.abc import Iterable, Sequence
from typing import Final

MOST_PLACES: Final = 100
"""Places that an error of a world names; a program wrote a world with more of them."""


class SimError(Exception):
    """The base class of this package's errors."""


class WorldError(SimError, ValueError):
    """A world file is wrong; its author has to correct it, and retrying cannot help.

    Attributes:
        world: the name of the file in messages.
        line: of the place, counted from 1.
        column: of the place, in characters, counted from 1.
        fact: the mistake at this place.
        remedy: the text to write instead.
    """

    def __init__(self, world: str, line: int, column: int, fact: str, remedy: str) -> None:
        super().__init__(world, line, column, fact, remedy)
        self.world = world
        self.line = line
        self.column = column
        self.fact = fact
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.world}:{self.line}:{self.column}: {self.fact}; {self.remedy}"


class WorldRefusedError(WorldError):
    """A world has several mistakes; the message has one line for each kind, with all its places.

    Attributes:
        errors: one for each place, in the order of the file, at most `MOST_PLACES`. The other attributes are
            those of the first.
    """

    def __init__(self, errors: tuple[WorldError, ...]) -> None:
        first = errors[0]
        super().__init__(first.world, first.line, first.column, first.fact, first.remedy)
        self.args = (errors,)  # the arguments of a copy
        self.errors = errors

    @property
    def summary(self) -> str:
        """Return one line, for output that shows only one."""
        return f"{self.world}: {_count(self.errors)} places are refused, the first is {self.errors[0]}"

    def __str__(self) -> str:
        kinds: dict[tuple[str, str], list[WorldError]] = {}
        for error in self.errors:
            kinds.setdefault((error.fact, error.remedy), []).append(error)
        return "\n".join(_in_one_line(errors) for errors in kinds.values())


def refusal(errors: Iterable[WorldError]) -> WorldError | None:
    """Return one error for all errors of a world, or for the first `MOST_PLACES`; None if there are none."""
    by_text: dict[str, WorldError] = {}
    for error in errors:
        by_text[str(error)] = error  # an error in a node that is used twice counts once
        if len(by_text) == MOST_PLACES:
            break
    found = sorted(by_text.values(), key=lambda error: (error.line, error.column))
    if len(found) > 1:
        return WorldRefusedError(tuple(found))
    return found[0] if found else None


def _count(errors: Sequence[WorldError]) -> str:
    return f"{len(errors)} or more" if len(errors) == MOST_PLACES else str(len(errors))


def _in_one_line(errors: list[WorldError]) -> str:
    """Return one line for errors that differ only in their places."""
    first = errors[0]
    if len(errors) == 1:
        return str(first)
    lines = ", ".join(map(str, dict.fromkeys(error.line for error in errors)))
    fact = f"{first.fact} ({_count(errors)} places, in lines {lines})"
    return str(WorldError(first.world, first.line, first.column, fact, first.remedy))


class RootError(SimError, ValueError):
    """A folder does not hold a world and all that it names; the message begins with the folder."""


class StandInError(SimError, ValueError):
    """A file of stand-ins is wrong; the message has file, type, field, fact and remedy."""


class UnknownWorldError(SimError, LookupError):
    """No world of that name ships with this package; the message names those that do."""


class ForeignPackageError(SimError, FileExistsError):
    """The folder for the package webots_ros has one that Palaestra did not write."""


class SidecarError(SimError, ValueError):
    """The sidecar cannot run as requested. Nothing was started, and retrying cannot help."""
