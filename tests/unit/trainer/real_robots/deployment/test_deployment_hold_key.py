"""A key counts as held while the terminal repeats it."""

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.real_robots.deployment.hold_key import HoldKey, KeyPresses


def presses(*times):
    """Return the presses after reports at these times, in seconds."""
    keys = KeyPresses()
    for time_s in times:
        keys.report(time_s)
    return keys


def test_a_single_press_is_no_hold():
    """A key that is touched by accident must not move a robot."""
    assert not presses(1.0).held(1.01)


def test_the_second_report_begins_the_hold_even_after_a_long_first_pause():
    """Terminals wait up to 0.7 s before they repeat a key."""
    assert presses(1.0, 1.7).held(1.75)


def test_the_hold_ends_a_quarter_of_a_second_after_the_last_report():
    """A terminal does not report that a key is released, so a missing report must end the hold."""
    keys = presses(1.0, 1.5, 1.53)

    assert keys.held(1.7)
    assert not keys.held(1.79)


def test_after_a_pause_the_key_must_be_held_again():
    """The first press after a pause is a single press again."""
    keys = presses(1.0, 1.5, 1.53, 2.5)

    assert not keys.held(2.51)


def test_no_press_is_no_hold():
    """Before a person touches the keyboard nothing moves."""
    assert not presses().held(0.0)


def test_a_program_without_a_terminal_is_refused(monkeypatch, tmp_path):
    """In a script nobody holds a key, and the remedy is another option."""
    with (tmp_path / "input").open("w+") as file:
        monkeypatch.setattr("sys.stdin", file)
        with pytest.raises(ConfigurationError, match=r"is not a terminal.*--no-hold"):
            HoldKey()
