"""Run a control plane without nodes until Ctrl-C: `python -m tests.control_plane`.

Prints the kubeconfig of its administrator when it is ready. Builds the programs if need be.
"""

import os
import signal
import sys
import tempfile
from pathlib import Path

from tests.control_plane.plane import running
from tests.control_plane.programs import REQUIRED

ENDS = {signal.SIGINT, signal.SIGTERM}


def main() -> int:
    """Run it; ends with the terminal that it runs in."""
    os.environ[REQUIRED] = "1"
    with tempfile.TemporaryDirectory(prefix="control-plane-") as folder, running(Path(folder)) as plane:
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDS)  # not before: the programs would inherit it
        sys.stdout.write(f"export KUBECONFIG={plane.kubeconfig}\n")
        sys.stdout.flush()
        signal.sigwait(ENDS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
