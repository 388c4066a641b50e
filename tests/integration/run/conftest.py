"""`palaestra run` as a person types it: real master, sidecars, stubs and trainer."""

import pytest

from tests.local_run import LocalRun
from tests.soak.jobs import example


@pytest.fixture
def run(tmp_path):
    """Makes runs of an example in a folder of their own; what is left of them is ended with the test."""
    made = []

    def make(name="move-to-target", **trainer):
        job = example(name)
        job["spec"]["trainer"].update(trainer)
        made.append(LocalRun(tmp_path, job))
        return made[-1]

    yield make
    for each in made:
        each.stop()
