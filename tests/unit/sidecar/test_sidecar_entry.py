"""The first imports of a sidecar's process."""

import json
import subprocess
import sys

FIRST = """
import json, sys
from palaestra_sim.sidecar import entry
print(json.dumps(sorted(name for name in sys.modules if name.startswith("palaestra"))))
"""


def test_signals_are_held_back_before_anything_else_is_imported():
    """Process 1 of a container loses a SIGTERM that arrives before signals are blocked.

    Each import before that moment makes this loss more likely.

    Only two modules come first. `shadowing` fixes the import path, because a user's `signal.py` may shadow
    Python's. `linux` checks the system, because other systems lack these signals.
    """
    said = subprocess.run([sys.executable, "-c", FIRST], capture_output=True, check=True, timeout=60)

    deciding = ["palaestra_protocol", "palaestra_protocol.linux", "palaestra_protocol.shadowing"]
    package = "palaestra_sim.sidecar"
    starting = ["palaestra_sim", package, f"{package}.blocked_signals", f"{package}.entry"]
    assert json.loads(said.stdout) == [*deciding, *starting]
