"""The first steps of a sidecar's process."""

import json
import subprocess
import sys

FIRST = """
import json, sys
from palaestra_sim.sidecar import entry
print(json.dumps(sorted(name for name in sys.modules if name.startswith("palaestra"))))
"""


def test_signals_are_held_back_before_anything_else_is_imported():
    """Until signals are blocked, process 1 of a container loses a SIGTERM.

    Every earlier import makes that longer.

    The import path is fixed before that, because a user's `signal.py` may shadow Python's.
    The system is looked at before that too, because others have no such signals.
    """
    said = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, check=True, timeout=60)

    deciding = ["palaestra_protocol", "palaestra_protocol.linux", "palaestra_protocol.shadowing"]
    package = "palaestra_sim.sidecar"
    starting = ["palaestra_sim", package, f"{package}.blocked_signals", f"{package}.entry"]
    assert json.loads(said.stdout) == [*deciding, *starting]
