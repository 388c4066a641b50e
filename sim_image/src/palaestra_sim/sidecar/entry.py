"""The start of `palaestra-sidecar`: it blocks signals before it imports the other modules.

In a container the sidecar is process 1. The kernel drops a signal to process 1 that the process neither
blocks nor handles. If SIGTERM arrived during the imports and was dropped, the pod would stay for its whole
grace period.
"""

import sys
from importlib import import_module

from palaestra_protocol.linux import require_linux
from palaestra_sim.sidecar.blocked_signals import hold_back


def main() -> int:
    """Run the sidecar until SIGTERM or SIGINT; return its exit code."""
    require_linux("palaestra-sidecar")
    hold_back()
    code: int = import_module("palaestra_sim.sidecar.cli").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
