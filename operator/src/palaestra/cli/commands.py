"""The names of all commands, in the order of the help: the module of each, and its line in the help.

`palaestra --help` is printed from this table alone, and a command imports only its own module: all of them
together take a second to import.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Command(NamedTuple):
    """One command.

    Attributes:
        module: in `palaestra.cli`; its function `add` declares the command.
        summary: the line in the help.
    """

    module: str
    summary: str


COMMANDS: Mapping[str, Command] = MappingProxyType(
    {
        "run": Command("run", "train on this machine"),
        "sweep": Command("sweep", "train with different values and compare"),
        "export": Command("exporting", "write a policy as one file for other programs"),
        "from-zoo": Command("from_zoo", "write a job from a file of RL-Baselines3-Zoo"),
        "plan": Command("documents", "print the objects that a job needs"),
        "world": Command("documents", "print one simulator's own world"),
        "crd": Command("documents", "print the CustomResourceDefinition"),
        "operator": Command("operator", "reconcile the jobs of a cluster"),
        "get": Command("looking", "list jobs"),
        "describe": Command("looking", "show a job in full"),
        "events": Command("looking", "list the events about a job"),
        "logs": Command("looking", "print the log of a container"),
        "watch": Command("watching", "show the progress of a job"),
        "suspend": Command("changing", "suspend jobs"),
        "resume": Command("changing", "resume suspended jobs"),
        "restart": Command("changing", "begin lost runs again"),
        "delete": Command("changing", "delete jobs"),
        "fetch": Command("fetching", "copy the results of a run"),
        "doctor": Command("doctor", "find out why jobs do not run"),
        "try": Command("trial", "run a small job in a cluster as a test"),
    }
)
