"""The arguments of `palaestra-ros2`."""

import pytest

from palaestra_trainer.cli.ros2_gateway import gateway


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give a run directory, or --master with --robot"),
        (["run", "--master", "http://localhost:1"], "give a run directory, or --master with --robot"),
        (["--master", "http://localhost:1"], "--master needs --robot"),
        (["--master", "http://localhost:1", "--robot", "a", "--simulator", "b"], "--simulator needs a run"),
    ],
)
def test_a_run_or_a_robot_at_a_master_must_be_named(arguments, message, capsys):
    """If the program guessed the robot, the gateway could show the wrong robot without a message."""
    with pytest.raises(SystemExit, match="2"):
        gateway(arguments)

    assert message in capsys.readouterr().err
