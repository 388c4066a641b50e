"""What can go wrong in a simulator's container, as one tree.

    SimError
    ├── WorldError (ValueError)          the .wbt file is wrong: retrying cannot help
    └── UnknownWorldError (LookupError)  no shipped world has that name: retrying cannot help

A message names the place, the fact and the remedy.
"""


class SimError(Exception):
    """Whatever this package raises on purpose."""


class WorldError(SimError, ValueError):
    """A world file is wrong, so retrying cannot help; the person who wrote it can.

    Attributes:
        world: the name that the file is known by.
        line: of the place, counted from 1.
        column: of the place, in characters, counted from 1.
        fact: what is there.
        remedy: what to write instead.
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


class UnknownWorldError(SimError, LookupError):
    """No world of that name ships with this package; the message names those that do."""
