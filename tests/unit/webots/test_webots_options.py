"""The controllerArgs of a robot in Webots, and a missing libController."""

import pytest

from palaestra_sim.webots.library import LibraryError, load
from palaestra_sim.webots.options import OptionError, read_options

NEEDED = ("--name=r", "--synchronize")


def test_options_are_those_of_webots_own_controller():
    """A world for Webots' controller needs no change."""
    options = read_options([*NEEDED, "--clock", "--auto-publish", "--ROS_MASTER_URI=http://m:1", "--what"])

    assert (options.name, options.clock, options.auto_publish) == ("r", True, True)
    assert (options.master_uri, options.unknown) == ("http://m:1", ("--what",))


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        (("--synchronize",), "add --name=NAME"),
        (("--name=", "--synchronize"), "add --name=NAME"),
        (("--name=r",), "add it, because this controller steps only on request"),
        (
            (*NEEDED, "--use-sim-time"),
            "has --use-sim-time, which this controller does not support; remove it",
        ),
        ((*NEEDED, "--robot-description=a"), "remove it"),
    ],
)
def test_a_wrong_option_is_refused_with_the_remedy(arguments, remedy):
    """Without the option, the robot would wait for ever, or share its names with another robot."""
    with pytest.raises(OptionError, match=remedy):
        read_options(arguments)


def test_a_missing_library_is_named(tmp_path):
    """A person who starts the controller by hand learns that Webots starts it."""
    with pytest.raises(LibraryError, match="WEBOTS_HOME is not set; Webots sets it"):
        load({})
    with pytest.raises(LibraryError, match=r"lib/controller/libController.so: .*use Webots R2023b or later"):
        load({"WEBOTS_HOME": str(tmp_path)})
