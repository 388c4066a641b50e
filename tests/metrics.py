"""The metrics that docs/reference/metrics.md documents, and the metrics that /metrics serves."""

import re
import subprocess
from pathlib import Path

from tests.control_plane.programs import programs

PAGE = Path(__file__).parents[1] / "docs/reference/metrics.md"


def documented(program):
    """Return the type of each metric family that the page documents for a program, by name."""
    table = PAGE.read_text().partition(f"\n## The {program}\n")[2].partition("\n## ")[0]
    return dict(re.findall(r"^\| `(palaestra_\w+)` \| (\w+)", table, re.MULTILINE))


def served(text):
    """Return the type of each `palaestra_` family in the text of /metrics, by name."""
    return dict(re.findall(r"^# TYPE (palaestra_\w+) (\w+)$", text, re.MULTILINE))


def complaints(text):
    """Return the complaints of `promtool check metrics` about the text of /metrics, or ""."""
    promtool = programs(("promtool",)) / "promtool"
    done = subprocess.run(
        [promtool, "check", "metrics"], input=text, capture_output=True, text=True, timeout=60, check=False
    )
    return done.stdout + done.stderr
