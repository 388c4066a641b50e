"""An operator that kills itself after N writes: `mortal.py N operator …`; with N = 0, it does not.

The operator ends when the API server has executed the write, and before it can react to the response.
"""

import os
import signal
import sys
import threading

from palaestra.cli import main
from palaestra.operator.metrics import Metrics

WRITES = {"create", "patch", "apply", "delete"}


def die_after(writes: int) -> None:
    """Make each operator of this process kill the process after `writes` writes.

    Writes of the Lease and of events do not count.
    """
    count, lock = 0, threading.Lock()
    told = Metrics.request

    def request(self: Metrics, verb: str, resource: str, code: int, seconds: float) -> None:
        nonlocal count
        told(self, verb, resource, code, seconds)
        if verb in WRITES and resource not in {"leases", "events"}:
            with lock:
                count += 1
                if count == writes:
                    os.kill(os.getpid(), signal.SIGKILL)

    Metrics.request = request


if __name__ == "__main__":
    if int(sys.argv[1]):
        die_after(int(sys.argv[1]))
    sys.exit(main(sys.argv[2:]))
