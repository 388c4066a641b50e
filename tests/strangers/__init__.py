"""A world and a program as other people bring them: shared by tests of one machine and of a cluster."""

from pathlib import Path

_FOLDER = Path(__file__).parent
WORLD = (_FOLDER / "rover.wbt").read_text()
DRIVE = (_FOLDER / "drive.py").read_text()


def rover():
    """Return the group of simulators of a job with that world; devices that the stub lacks are left out."""
    return {
        "name": "collect",
        "role": "Collect",
        "world": {"inline": WORLD},
        "options": ["--leave-out", "all"],
    }
