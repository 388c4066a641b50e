"""Refusing to start on a system other than Linux, in one sentence.

Programs that start, watch or are simulators need Linux: its `/proc`, subreapers, pidfds, epoll and signals.
The rest of `palaestra`, such as `get` and `explain`, runs wherever Python does.
"""

import sys

_WRONG_SYSTEM = 2


def lack_of_linux() -> str | None:
    """Return the fact and the remedy where this system is not Linux, otherwise None."""
    system: str = sys.platform
    if system == "linux":
        return None
    return f"needs Linux, and this system is {system}; run it on Linux, in a container or in WSL 2"


def require_linux(program: str) -> None:
    """Return on Linux; on another system, print one sentence and end this process.

    Raises:
        SystemExit: this system is not Linux.
    """
    if (problem := lack_of_linux()) is not None:
        sys.stderr.write(f"{program}: {problem}\n")
        raise SystemExit(_WRONG_SYSTEM)
