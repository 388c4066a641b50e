"""The jobs, worlds and options on docs/howto/webots.md are accepted by the programs that read them."""

import re
from pathlib import Path

import pytest
import yaml

from palaestra.api import validate
from palaestra.api.reasons import Reason
from palaestra_sim.webots.options import OptionError, read_options
from tests.jobs import make_job
from tests.pages import blocks, chapters
from tools.images.__main__ import main

PAGE = (Path(__file__).parents[3] / "docs/howto/webots.md").read_text()
CHAPTERS = dict(chapters(PAGE))
NEEDED = ("--name=robot", "--synchronize")


@pytest.mark.parametrize("part", blocks(PAGE, "yaml"))
def test_the_groups_of_the_page_are_part_of_a_job(part):
    """A reader copies a group into a job."""
    groups = yaml.safe_load(part)["simulators"]
    other = {"Collect": "Evaluate", "Evaluate": "Collect"}[groups[0]["role"]]

    job = validate(make_job(simulators=[*groups, {"name": "other", "role": other}]))

    assert job.spec.simulators[0].driver == "webots"


def test_the_controller_accepts_the_world_of_the_page():
    """A reader copies the robot into a world."""
    [world] = [text for text in blocks(PAGE, "text") if "controllerArgs" in text]
    given = re.findall(r'"(.+?)"', re.search(r"controllerArgs \[(.+)\]", world)[1])

    assert read_options(given).name == "my_robot"
    assert read_options(given).unknown == ()


def test_the_table_of_options_is_that_of_the_controller():
    """A reader decides by this table whether a world of webots_ros runs unchanged."""
    rows = re.findall(r"^\| (`--.+?) \| (.+) \|$", CHAPTERS["The world"], re.MULTILINE)
    meanings = {name: meaning for names, meaning in rows for name in re.findall(r"`(--[\w-]+)", names)}
    refused = {name for name, meaning in meanings.items() if meaning.startswith("refused")}

    for name in meanings.keys() - refused:
        given = name if name in ("--synchronize", "--clock", "--auto-publish") else f"{name}=x"
        assert read_options([*NEEDED, given]).unknown == ()
    assert refused
    for name in refused:
        with pytest.raises(OptionError, match="does not support"):
            read_options([*NEEDED, name])


def test_the_commands_that_build_the_image_are_accepted(capsys):
    """The program checks its options before it looks for the archive, which this machine lacks."""
    typed = [line.split()[1:] for line in PAGE.splitlines() if line.startswith("tools/images.sh")]

    assert len(typed) == 2
    for arguments in typed:
        assert main(arguments) == 1
        assert "No such file or directory; give a file that you can read" in capsys.readouterr().err


def test_the_reason_of_a_job_without_an_image_exists():
    """A reader searches the page for the reason in the status."""
    assert f"`{Reason.NO_IMAGE}`" in CHAPTERS["In a cluster"]
