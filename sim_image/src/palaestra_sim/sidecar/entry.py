"""The start of the sidecar's program: it holds back signals, and imports everything else only then.

Process 1 of a container loses a signal that comes before it asks for signals. A pod whose trainer ends while
its sidecars import would stay for its whole grace period.
"""

import sys
from importlib import import_module

from palaestra_sim.sidecar.blocked_signals import hold_back


def main() -> int:
    """Run the sidecar until SIGTERM or SIGINT; return its exit code."""
    hold_back()
    code: int = import_module("palaestra_sim.sidecar.cli").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
