"""Run a control plane without nodes until Ctrl-C: `python -m tests.control_plane`.

It prints the path of its administrator's kubeconfig when it is ready, and builds its programs if they are
missing.
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
    """Run it; it ends with its terminal."""
    os.environ[REQUIRED] = "1"
    with tempfile.TemporaryDirectory(prefix="control-plane-") as folder, running(Path(folder)) as plane:
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDS)  # not earlier, because the programs would inherit it
        sys.stdout.write(f"export KUBECONFIG={plane.kubeconfig}\n")
        sys.stdout.flush()
        signal.sigwait(ENDS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
