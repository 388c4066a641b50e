"""A world and a program from other people, shared by tests of one machine and of a cluster."""

from pathlib import Path

_FOLDER = Path(__file__).parent
WORLD = (_FOLDER / "rover.wbt").read_text()
DRIVE = (_FOLDER / "drive.py").read_text()


def rover():
    """Return a job's group of simulators with that world; the stub leaves out the devices that it lacks."""
    return {
        "name": "collect",
        "role": "Collect",
        "world": {"inline": WORLD},
        "options": ["--leave-out", "all"],
    }
