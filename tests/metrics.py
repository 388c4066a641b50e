"""The metrics in docs/reference/metrics.md as a reader sees them, and /metrics as Prometheus sees it."""

import re
import subprocess
from pathlib import Path

from tests.control_plane.programs import programs

PAGE = Path(__file__).parents[1] / "docs/reference/metrics.md"


def documented(program):
    """Return the type of each family in a program's table of the page, by its name."""
    table = PAGE.read_text().partition(f"\n## The {program}\n")[2].partition("\n## ")[0]
    return dict(re.findall(r"^\| `(palaestra_\w+)` \| (\w+)", table, re.MULTILINE))


def served(text):
    """Return the type of each of our families in the text of /metrics, by its name."""
    return dict(re.findall(r"^# TYPE (palaestra_\w+) (\w+)$", text, re.MULTILINE))


def complaints(text):
    """Return the complaints of `promtool check metrics` about the text of /metrics, or ""."""
    promtool = programs(("promtool",)) / "promtool"
    done = subprocess.run(
        [promtool, "check", "metrics"], input=text, capture_output=True, text=True, timeout=60, check=False
    )
    return done.stdout + done.stderr
