"""The command line of the mock robot, as far as it refuses to start."""

import socket

import pytest

from palaestra_sim.mock_robot.cli import main


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        (["nowhere"], "WORLD: nowhere: No such file or directory; give a .wbt file, or the name of"),
        (["--start=2,0,0"], "--start: x 2, y 0: an obstacle is there; choose a free place"),
        (["--start=1,2"], "argument --start: '1,2' is not a pose; give three numbers as X,Y,HEADING"),
        (["--start=1,2,nan"], "argument --start: '1,2,nan' is not finite; give three finite numbers"),
        (["--listen=here"], "argument --listen: 'here' is not an address such as"),
        (["--speed=0"], "argument --speed: 0 is refused; give a number above 0"),
        (["--drift=2"], "argument --drift: 2 is refused; give 0 to 1"),
        (["--timeouts=x"], "argument --timeouts: 'x' is not a number"),
    ],
)
def test_a_wrong_option_has_one_sentence(typed, message, capsys):
    """The sentence must name the option, the fact and the remedy."""
    with pytest.raises(SystemExit) as ended:
        raise SystemExit(main(typed))

    assert ended.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


def test_a_port_in_use_is_refused(capsys):
    """Two robots on one port would be confused."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code = main([f"--listen=127.0.0.1:{port}"])

    assert code == 2
    message = f"palaestra-mock-robot: --listen: 127.0.0.1:{port}: Address already in use; choose another"
    assert capsys.readouterr().err.startswith(message)
