"""An operator keeps in memory only what it uses, because it runs for months next to other programs."""

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
    """Tables, commands in containers and kubeconfigs took 20 of 62 MiB."""
    done = subprocess.run([sys.executable, "-c", START], capture_output=True, text=True, check=True)
    imported = set(json.loads(done.stderr))

    assert "palaestra.operator.run" in imported
    assert imported.intersection(PEOPLES) == set()
