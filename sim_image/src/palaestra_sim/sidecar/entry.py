"""The start of the sidecar's program: it blocks signals before it imports anything else.

Process 1 of a container loses a signal that arrives before the process blocks or handles it. If the trainer
ended during the imports of the sidecar, the pod would stay for its whole grace period.
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
