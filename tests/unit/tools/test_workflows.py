"""Workflows use only reviewed versions of actions."""

import re
from pathlib import Path

WORKFLOWS = Path(__file__).parents[3] / ".github" / "workflows"


def test_every_action_is_named_by_a_commit_and_its_release():
    """A tag can be moved to another commit, and an action can read all that its workflow can read."""
    uses = [
        line.split("uses:", 1)[1].strip()
        for path in WORKFLOWS.glob("*.yaml")
        for line in path.read_text().splitlines()
        if "uses:" in line
    ]

    assert uses
    assert [use for use in uses if not re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", use)] == []
