"""The options of the sidecar that a job sets by a variable."""

import pytest

from palaestra_sim.sidecar.options import parse

NEEDED = ("--driver=webots", "--world=arena")


@pytest.mark.parametrize(
    ("options", "environment", "controller"),
    [
        ((), {}, "palaestra"),
        ((), {"WEBOTS_ROS_CONTROLLER": "webots"}, "webots"),
        (("--webots-controller=palaestra",), {"WEBOTS_ROS_CONTROLLER": "webots"}, "palaestra"),
    ],
)
def test_a_variable_chooses_the_controller_and_an_option_precedes_it(options, environment, controller):
    """A job can set variables of its simulators, but no option of the sidecar."""
    assert parse([*NEEDED, *options], environment).webots_controller == controller


def test_a_wrong_variable_ends_the_sidecar_with_one_sentence(capsys):
    """A typing error would choose another controller, and no message would report it."""
    with pytest.raises(SystemExit):
        parse(NEEDED, {"WEBOTS_ROS_CONTROLLER": "mine"})

    printed = capsys.readouterr().err
    assert "WEBOTS_ROS_CONTROLLER: 'mine' is not a controller; set palaestra or webots" in printed
