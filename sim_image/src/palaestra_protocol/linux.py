"""End a program with a message if the system is not Linux.

Simulators, and the programs that start or watch simulators, need Linux: they use `/proc`, subreapers, pidfds,
epoll and signals. Other commands of `palaestra`, such as `get` and `explain`, run on every system that has
Python.
"""

import sys

_WRONG_SYSTEM = 2


def lack_of_linux() -> str | None:
    """Return None on Linux; on another system, return the problem and the remedy."""
    system: str = sys.platform
    if system == "linux":
        return None
    return f"needs Linux, and this system is {system}; run it on Linux, in a container or in WSL 2"


def require_linux(program: str) -> None:
    """Do nothing on Linux; on another system, print the problem and exit.

    Raises:
        SystemExit: this system is not Linux.
    """
    if (problem := lack_of_linux()) is not None:
        sys.stderr.write(f"{program}: {problem}\n")
        raise SystemExit(_WRONG_SYSTEM)
