"""The example scripts and the blocks of pages work as a user runs them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pages import blocks

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples"


def carried_out(*program, folder=None, **variables):
    """Run a Python program without a pod, a runner and a ROS master, and return the result."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    return subprocess.run(
        [sys.executable, *program],
        capture_output=True,
        text=True,
        timeout=200,
        check=True,
        cwd=folder,
        env={**environment, "MPLBACKEND": "agg", **variables},
    )


def test_the_facade_example_drives_and_reads():
    """A user copies the script from the page about notebooks."""
    result = carried_out(EXAMPLES / "facade.py")

    assert result.stdout.startswith("Pose(x_m=0.03")
    assert "free" in result.stdout
    assert result.stderr == ""


@pytest.mark.parametrize("driver", ["stub", "mujoco"])
def test_the_blocks_of_the_page_about_facades_are_one_script(driver):
    """A reader pastes the page's blocks, in order, into one script, which also starts the ROS master."""
    page = (ROOT / "docs/howto/facades.md").read_text()
    script = "\n".join(blocks(page, "python with-a-simulator"))

    result = carried_out("-c", script.replace('"arena")', f'"arena", driver="{driver}")'))

    assert "# robotino is paused; step inside `with webots:`" in page
    assert "\nrobotino is paused; step inside `with webots:`\n" in result.stdout
    assert result.stderr == ""


def test_the_blocks_of_the_page_about_a_training_loop_are_one_script():
    """A reader pastes the page's blocks, in order, into a training loop."""
    page = (ROOT / "docs/howto/training-loop.md").read_text()

    result = carried_out("-c", "\n".join(blocks(page, "python with-a-simulator")))

    assert result.stderr == ""


def test_the_listings_of_the_paper_run_in_their_order():
    """The simulator crashes after every 80 steps, and the script must continue without a person's help."""
    result = carried_out(EXAMPLES / "paper.py", PALAESTRA_STUB_FAULTS="crash:step=80")

    assert result.stdout.count("simulator fault") >= 2
    assert "done: 200 steps, mean return" in result.stdout
