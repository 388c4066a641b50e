"""docs/start/your-environment.md leads from an empty folder to a trained policy on this machine."""

import json
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.local_run import PALAESTRA
from tests.pages import blocks, fenced
from tests.terminal import Terminal

TEXT = (Path(__file__).parents[3] / "docs/start/your-environment.md").read_text()
PAGE = dict(fenced(TEXT))
FILES = ("python corridor.py", "python try.py", "yaml job.yaml")
TYPED_S = 500
MOST_LINES = 45


@pytest.mark.minutes(1)
@pytest.mark.timeout(600)
def test_a_policy_is_trained_from_an_empty_folder(tmp_path):
    """A reader has only the page's files and commands, and the policy must have learned the task."""
    printed = typed(tmp_path, FILES, 0)

    run = tmp_path / "runs/corridor/0"
    assert (run / "model.zip").is_file()
    assert success_rate(run) >= 0.6, printed


@pytest.mark.minutes(1)
@pytest.mark.timeout(600)
def test_the_same_task_is_learned_by_an_e_puck(tmp_path):
    """A reader needs only a class for the drive of another robot, and two lines in the job."""
    printed = typed(tmp_path, ("python corridor.py", "python puck.py", "yaml puck.yaml"), 1)

    assert success_rate(tmp_path / "runs/puck/0") >= 0.6, printed


def typed(folder, files, number):
    """Write files of the page, run the commands of one of its sessions, and return the output."""
    for name in files:
        (folder / name.split()[1]).write_text(PAGE[name])
    return Terminal(folder, path=PALAESTRA.parent).type_in(blocks(TEXT, "sh")[number], TYPED_S)


def success_rate(run):
    """Return the success rate of a finished run."""
    return json.loads((run / "summary.json").read_text())["success_rate"]


def test_the_task_is_short_and_its_image_is_of_this_release():
    """Readers finish only a short tutorial, and an image of another release might not work."""
    assert len(PAGE["python corridor.py"].splitlines()) < MOST_LINES
    assert (
        PAGE["dockerfile Dockerfile"].splitlines()[0]
        == f"FROM palaestra-trainer:{version('palaestra-trainer')}"
    )
