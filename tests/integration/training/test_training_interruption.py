"""Signals that come before a run listens for them."""

import subprocess
import sys

ASKED_DURING_IMPORTS = """
import os, signal
from palaestra_trainer.waiting.interruption import leaving_when_asked
with leaving_when_asked():
    os.kill(os.getpid(), signal.SIGTERM)
"""


def test_a_trainer_that_is_asked_to_end_before_its_run_begins_was_interrupted():
    """Its imports take seconds; an eviction in them must not count as a failure of the trainer."""
    ended = subprocess.run(
        [sys.executable, "-c", ASKED_DURING_IMPORTS], capture_output=True, text=True, check=False
    )

    assert ended.returncode == 75, ended.stderr
    assert "nothing was started" in ended.stderr
