"""Signals before a run can handle them, and after its end."""

import subprocess
import sys

ASKED_DURING_IMPORTS = """
import os, signal
from palaestra_trainer.run.signals import leaving_when_asked
with leaving_when_asked():
    os.kill(os.getpid(), signal.SIGTERM)
"""

ASKED_AT_EXIT = """
import atexit, os, signal
from palaestra_trainer.run.signals import leaving_when_asked
atexit.register(os.kill, os.getpid(), signal.SIGTERM)
with leaving_when_asked():
    pass
"""


def test_a_trainer_that_is_asked_to_end_before_its_run_begins_was_interrupted():
    """Imports take seconds, and an eviction at that time must not count as a failure of the trainer."""
    ended = subprocess.run(
        [sys.executable, "-c", ASKED_DURING_IMPORTS], capture_output=True, text=True, check=False
    )

    assert ended.returncode == 75, ended.stderr
    assert "nothing was started" in ended.stderr


def test_a_trainer_that_is_asked_to_end_after_its_run_keeps_its_exit_code():
    """Python needs a second to exit, and a completed run must not count as killed."""
    ended = subprocess.run([sys.executable, "-c", ASKED_AT_EXIT], capture_output=True, text=True, check=False)

    assert ended.returncode == 0, ended.stderr
