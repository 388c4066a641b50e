"""The errors of a simulator's container, as one tree.

    SimError
    ├── WorldError              a world file is wrong: retrying cannot help
    │   └── WorldRefusedError   a world file has several mistakes; the message lists all of them
    ├── RootError               a folder does not hold all files that a world names: retrying cannot help
    ├── StandInError            a file of stand-ins is wrong: retrying cannot help
    ├── UnknownWorldError       no shipped world has that name: retrying cannot help
    ├── ForeignPackageError     the folder has a webots_ros that we did not write: retrying cannot help
    ├── SidecarError            the sidecar cannot run as requested: retrying cannot help
    ├── FaultError              the description of a fault is wrong (faults.parser)
    ├── NoSuchHandleError       the loaded world has no node or field for a handle (ros_controller.handles)
    ├── NoValueError            a field has no value of that type or index (scene.tree)
    ├── LibraryError            libController is missing, or lacks a function (webots.library)
    ├── OptionError             the controllerArgs of a robot in Webots are wrong (webots.options)
    ├── UnknownHandleError      no service has returned the handle of a node or field (webots.services)
    ├── MissingLibraryError     a simulator needs a package that is not installed (mujoco.library)
    ├── BatchRefusedError       --batch cannot simulate the world: retrying cannot help (mujoco.batched)
    ├── MockRobotError          a mock robot cannot do what was requested (mock_robot.robot)
    └── UnsimulatedError        Webots supports the request, this simulator does not (ros_interfaces)

Each error message names the file or option, the mistake and the remedy.
"""

from collections.abc import Iterable, Sequence
from typing import Final

MOST_PLACES: Final = 100
"""Maximum number of places that one error lists; a person seldom makes more mistakes in a file."""


class SimError(Exception):
    """The base class of this package's errors."""


class WorldError(SimError, ValueError):
    """A world file is wrong; its author has to correct it, and retrying cannot help.

    Attributes:
        world: the name of the file in messages.
        line: the line of the mistake, counted from 1.
        column: the column of the mistake, in characters, counted from 1.
        fact: a description of the mistake.
        remedy: the change that corrects the mistake.
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
    """A world file has several mistakes.

    The message has one line for each kind of mistake, with the lines of the file where the mistake occurs.
    The attributes of `WorldError` describe the first mistake.

    Attributes:
        errors: one error for each mistake, in the order of the file, at most `MOST_PLACES`.
    """

    def __init__(self, errors: tuple[WorldError, ...]) -> None:
        first = errors[0]
        super().__init__(first.world, first.line, first.column, first.fact, first.remedy)
        self.args = (errors,)  # `copy` and `pickle` call the class with these arguments
        self.errors = errors

    @property
    def summary(self) -> str:
        """Return a message of one line, for programs that show only one line."""
        return f"{self.world}: {_count(self.errors)} places are refused, the first is {self.errors[0]}"

    def __str__(self) -> str:
        kinds: dict[tuple[str, str], list[WorldError]] = {}
        for error in self.errors:
            kinds.setdefault((error.fact, error.remedy), []).append(error)
        return "\n".join(_in_one_line(errors) for errors in kinds.values())


def refusal(errors: Iterable[WorldError]) -> WorldError | None:
    """Return one error that combines the first `MOST_PLACES` of `errors`; None if there are no errors."""
    by_text: dict[str, WorldError] = {}
    for error in errors:
        by_text[str(error)] = error  # a node that is used twice reports the same error twice
        if len(by_text) == MOST_PLACES:
            break
    found = sorted(by_text.values(), key=lambda error: (error.line, error.column))
    if len(found) > 1:
        return WorldRefusedError(tuple(found))
    return found[0] if found else None


def _count(errors: Sequence[WorldError]) -> str:
    return f"{len(errors)} or more" if len(errors) == MOST_PLACES else str(len(errors))


def _in_one_line(errors: list[WorldError]) -> str:
    """Return one line for errors that have the same fact and remedy, at different lines of the file."""
    first = errors[0]
    if len(errors) == 1:
        return str(first)
    lines = ", ".join(map(str, dict.fromkeys(error.line for error in errors)))
    fact = f"{first.fact} ({_count(errors)} places, in lines {lines})"
    return str(WorldError(first.world, first.line, first.column, fact, first.remedy))


class RootError(SimError, ValueError):
    """A folder does not hold a world and all of the world's files; the message begins with the folder."""


class StandInError(SimError, ValueError):
    """A file of stand-ins is wrong; the message has file, type, field, fact and remedy."""


class UnknownWorldError(SimError, LookupError):
    """This package has no world of that name; the message lists the names of its worlds."""


class ForeignPackageError(SimError, FileExistsError):
    """The folder has a package webots_ros that Palaestra did not write."""


class SidecarError(SimError, ValueError):
    """The sidecar cannot run as requested. Nothing was started, and retrying cannot help."""
