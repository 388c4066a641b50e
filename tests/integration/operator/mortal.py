"""An operator that dies: `mortal.py N operator …` kills itself once N writes were answered; 0: never.

Death comes after the API server has done the write and before the operator can do anything about it.
"""

import os
import signal
import sys
import threading

from palaestra.cli import main
from palaestra.operator.metrics import Metrics

WRITES = {"create", "patch", "apply", "delete"}


def die_after(writes: int) -> None:
    """Let every operator of this process die after so many writes; the Lease's do not count."""
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
