"""All commands in the order of the help, each with its module and its line in the help.

The import of all modules takes a second. So `palaestra --help` is printed from this table alone, and a
command imports only its own module.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Command(NamedTuple):
    """One command.

    Attributes:
        module: name of a module in `palaestra.cli`; the module's function `add` declares the command.
        summary: the line in the help.
    """

    module: str
    summary: str


COMMANDS: Mapping[str, Command] = MappingProxyType(
    {
        "run": Command("run", "train on this machine"),
        "demo": Command("demo", "watch a robot learn, and break its simulator"),
        "sweep": Command("sweep", "train with different values and compare"),
        "compare": Command("compare", "find out which of two policies is better"),
        "report": Command("report", "write the report of runs as one HTML file"),
        "view": Command("view", "look at the simulators of a run in a browser"),
        "export": Command("export", "write a policy as one file for other programs"),
        "deploy": Command("deploy", "drive a real robot with a policy package"),
        "from-zoo": Command("from_zoo", "write a job from a file of RL-Baselines3-Zoo"),
        "explain": Command("explain", "show what a field of a job means"),
        "plan": Command("offline_commands", "print the objects that a job needs"),
        "world": Command("offline_commands", "print the copy of a world that one simulator gets"),
        "webots-project": Command("webots_project", "write the controller `ros` for Webots on a desktop"),
        "crd": Command("offline_commands", "print the CustomResourceDefinition"),
        "operator": Command("operator", "reconcile the jobs of a cluster"),
        "get": Command("read_commands", "list jobs"),
        "describe": Command("read_commands", "show a job in full"),
        "events": Command("read_commands", "list the events about a job"),
        "logs": Command("read_commands", "print the log of a container"),
        "watch": Command("watch", "show the progress of a job"),
        "suspend": Command("lifecycle_commands", "suspend jobs"),
        "resume": Command("lifecycle_commands", "resume suspended jobs"),
        "restart": Command("lifecycle_commands", "begin lost runs again"),
        "delete": Command("lifecycle_commands", "delete jobs"),
        "fetch": Command("fetch", "copy the results of a run"),
        "doctor": Command("doctor", "find out why jobs do not run"),
        "try": Command("smoke_test", "run a small job in a cluster, or a few episodes here, as a test"),
    }
)
