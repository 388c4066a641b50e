"""A world and a program that Palaestra did not provide, for tests on one machine and in a cluster."""

from pathlib import Path

_FOLDER = Path(__file__).parent
WORLD = (_FOLDER / "rover.wbt").read_text()
DRIVE = (_FOLDER / "drive.py").read_text()


def rover():
    """Return a job's group of simulators with this world; the stub leaves out unsupported devices."""
    return {
        "name": "collect",
        "role": "Collect",
        "world": {"inline": WORLD},
        "options": ["--leave-out", "all"],
    }
