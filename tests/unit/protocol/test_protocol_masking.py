"""Passwords in addresses are masked in every text that leaves a process."""

import json

import pytest
import structlog
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api.text import one_line, printable
from palaestra_protocol.fields import clipped
from palaestra_protocol.masking import masked
from palaestra_protocol.pod.status import FaultRecord, Termination
from palaestra_trainer.run.telemetry import logs

ADDRESS = "http://alice:S3CR@ET@127.0.0.1:5000/api?to=a@b"
SECRET = "S3CR"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (f"no answer from {ADDRESS}.", "no answer from http://***@127.0.0.1:5000/api?to=a@b."),
        ("https://TOKEN@host and socks5://u:p@h:1", "https://***@host and socks5://***@h:1"),
        ("http://host/a@b is as it was", "http://host/a@b is as it was"),
        ("mail a@b, see http://host", "mail a@b, see http://host"),
    ],
)
def test_the_user_information_of_each_address_is_masked(text, wanted):
    """The host of the address stays visible, so a person sees which server was requested."""
    assert masked(text) == wanted


@given(st.text(st.characters(exclude_characters="/?#@ ", exclude_categories=["Z", "C"]), min_size=1))
def test_no_password_is_left_whatever_it_is_made_of(password):
    """By RFC 3986, user information ends at the last @ before a slash, a question mark or a number sign."""
    assert masked(f"ftp://user:{password}@host/x") == "ftp://***@host/x"


def test_no_text_that_leaves_a_trainer_has_it(capsys):
    """Everyone who may read the pod's log or status sees these texts, so a password in them would leak."""
    before = structlog.get_config()
    try:
        logs.configure_logs()
        structlog.get_logger().error("no answer", address=ADDRESS, exc_info=OSError(ADDRESS))
    finally:
        structlog.configure(**before)
    fault = FaultRecord(simulator="collect-0", kind="dead", fact=ADDRESS, step=1, time="now")
    word = Termination(step=1, reason=ADDRESS, log=logs.last_lines(), faults=(fault,)).to_message()

    shown = capsys.readouterr().err
    assert "127.0.0.1:5000" in shown
    assert json.loads(word)["reason"] == masked(ADDRESS)
    assert SECRET not in shown + word + "".join(logs.last_lines())


@pytest.mark.parametrize("shorten", [lambda text: one_line(text, 200), printable, clipped])
def test_no_text_that_a_command_prints_or_a_status_keeps_has_it(shorten):
    """The text of an error may come from a user's program and contain a password."""
    assert shorten(ADDRESS) == masked(ADDRESS)
