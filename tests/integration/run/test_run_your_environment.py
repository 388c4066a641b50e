"""docs/your-environment.md on this machine: from an empty folder to a trained policy."""

import json
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.local_run import PALAESTRA
from tests.pages import blocks, fenced
from tests.terminal import Terminal

TEXT = (Path(__file__).parents[3] / "docs/your-environment.md").read_text()
PAGE = dict(fenced(TEXT))
FILES = ("python corridor.py", "python try.py", "yaml job.yaml")
TYPED_S = 500
MOST_LINES = 40


@pytest.mark.minutes(1)
@pytest.mark.timeout(600)
def test_a_policy_is_trained_from_an_empty_folder(tmp_path):
    """With what the page shows and nothing else; the policy has learned the task."""
    for name in FILES:
        (tmp_path / name.split()[1]).write_text(PAGE[name])
    [session] = blocks(TEXT, "sh")

    printed = Terminal(tmp_path, path=PALAESTRA.parent).type_in(session, TYPED_S)

    run = tmp_path / "runs/corridor/0"
    assert (run / "model.zip").is_file()
    assert json.loads((run / "summary.json").read_text())["success_rate"] >= 0.6, printed


def test_the_task_is_short_and_its_image_is_of_this_release():
    """A tutorial is read to its end if it is short; a tag of another release is another interface."""
    assert len(PAGE["python corridor.py"].splitlines()) < MOST_LINES
    assert (
        PAGE["dockerfile Dockerfile"].splitlines()[0]
        == f"FROM palaestra-trainer:{version('palaestra-trainer')}"
    )
