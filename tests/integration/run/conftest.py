"""`palaestra run` as a user types it, with a real ROS master, sidecars, stubs and trainer."""

import pytest

from tests.jobs import example
from tests.local_run import LocalRun


@pytest.fixture
def run(tmp_path):
    """Yield a function that returns runs of an example in a separate folder; all end with the test."""
    made = []

    def make(name="move-to-target", **trainer):
        job = example(name)
        job["spec"]["trainer"].update(trainer)
        made.append(LocalRun(tmp_path, job))
        return made[-1]

    yield make
    for each in made:
        each.stop()
