"""Run a control plane without nodes until Ctrl-C: `python -m tests.control_plane`.

The program builds the programs of the control plane if they are missing. When the control plane is ready, the
program prints the path of an administrator's kubeconfig.
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
    """Run the control plane until SIGINT or SIGTERM."""
    os.environ[REQUIRED] = "1"
    with tempfile.TemporaryDirectory(prefix="control-plane-") as folder, running(Path(folder)) as plane:
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDS)  # after the start of child programs, which inherit it
        sys.stdout.write(f"export KUBECONFIG={plane.kubeconfig}\n")
        sys.stdout.flush()
        signal.sigwait(ENDS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
