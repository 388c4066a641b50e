"""An operator runs for months next to other programs, so it must not load modules that it does not use."""

import json
import subprocess
import sys

START = """
import json, sys
from palaestra.cli import main
try:
    main(["operator", "--help"])
except SystemExit:
    sys.stderr.write(json.dumps(sorted(sys.modules)))
"""
PEOPLES = (
    "kubernetes", "oauthlib", "pygments", "requests", "rich", "websocket", "palaestra.client",
    "palaestra.doctor", "palaestra.local.run", "palaestra.view",
)  # fmt: skip


def test_an_operator_imports_nothing_that_only_peoples_tools_need():
    """Modules for tables, `kubectl exec` and kubeconfigs used 20 of the operator's 62 MiB of memory."""
    done = subprocess.run([sys.executable, "-c", START], capture_output=True, text=True, check=True)
    imported = set(json.loads(done.stderr))

    assert "palaestra.operator.run" in imported
    assert imported.intersection(PEOPLES) == set()
