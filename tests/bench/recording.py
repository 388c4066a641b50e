"""Recording the figures of a part in a file of JSON, with the machine, its load and the versions.

`tools.peers` makes docs/explain/peers.md from this file. The file has no date, so another measurement
changes only the lines whose values differ.
"""

import json
import os
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("palaestra-trainer", "stable-baselines3", "gymnasium", "torch", "numpy")
CPU_INFO = Path("/proc/cpuinfo")


def record(path, line, load, versions=None):
    """Write a part's line into the file, in place of the part's former figures.

    Args:
        path: the file; it is created if it does not exist.
        line: the line that the part prints.
        load: the load averages of one minute before and after the part.
        versions: versions of further packages, by name.
    """
    path = Path(path)
    recorded = json.loads(path.read_text()) if path.exists() else {}
    line = dict(line)
    part, scale = line.pop("part"), line.pop("scale")
    recorded[part] = {
        "command": " ".join(("python -m tests.bench", *options(part, scale), part)),
        "machine": machine(),
        "load": [round(each, 1) for each in load],
        "versions": installed() | (versions or {}),
        "figures": line,
    }
    path.write_text(json.dumps(dict(sorted(recorded.items())), indent=2) + "\n")


def options(part, scale):
    """Return the options of the command that measures a part."""
    if part == "rllib":
        yield "--rllib PYTHON"
    if scale != 1.0:
        yield f"--scale {scale:g}"


def load():
    """Return the load average of the last minute."""
    return os.getloadavg()[0]


def machine():
    """Return the name and the number of this machine's processors."""
    found = re.search(r"^model name\s*: (.+)$", CPU_INFO.read_text(), re.MULTILINE)
    return {"processor": found[1] if found else platform.machine(), "processors": os.cpu_count()}


def installed():
    """Return the versions of Python and of the installed packages that are measured."""
    found = {"Python": platform.python_version()}
    for package in (*PACKAGES, "rospy"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
