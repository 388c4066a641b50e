"""Logs and commands in containers: the output is complete, or the client raises an error.

A scripted server stands in for the kubelet.
"""

import json
import time

import pytest

from palaestra.cluster import CommandFailed, Forbidden, Unreachable
from tests.integration.apiserver.server import command, raw, refusal, stream

SUCCESS = b"\x03" + json.dumps({"status": "Success"}).encode()
FAILURE = (
    b"\x03"
    + json.dumps(
        {
            "status": "Failure",
            "reason": "NonZeroExitCode",
            "details": {"causes": [{"reason": "ExitCode", "message": "7"}]},
        }
    ).encode()
)
NOT_STARTED = (
    b"\x03"
    + json.dumps({"status": "Failure", "reason": "InternalError", "message": "no such program"}).encode()
)


def run(api, within_s=5.0):
    """Return the complete standard output of a command."""
    return b"".join(api.execute("lab", "pod", "trainer", ["cat", "a b"], within_s=within_s))


def test_output_arrives_byte_for_byte_without_what_was_said(rude):
    """The output may be a tar file, which warnings on standard error would destroy."""
    rude.script.calls = [command(b"\x01\x00\xff\r\n", b"\x02warning", b"\x01\x01", SUCCESS)]

    assert run(rude.api) == b"\x00\xff\r\n\x01"


def test_a_command_is_asked_for_as_this_identity(rude):
    """RBAC checks the permission `create pods/exec` of the user in the kubeconfig."""
    rude.script.calls = [command(SUCCESS)]

    run(rude.api)

    [asked] = rude.script.of(watches=False)
    assert asked.path == "/api/v1/namespaces/lab/pods/pod/exec"
    assert asked.query["container"] == "trainer"
    assert asked.query["command"] == "a b"
    assert asked.headers["Authorization"] == "Bearer my-token"


def test_an_exit_code_comes_with_what_the_command_said(rude):
    """The standard error of the command explains the exit code to a user."""
    rude.script.calls = [command(b"\x01half", b"\x02No such file", FAILURE)]

    with pytest.raises(CommandFailed, match="exit code 7: No such file") as failed:
        run(rude.api)
    assert failed.value.code == 7


def test_a_missing_program_raises_an_error_with_the_runtimes_words(rude):
    """Without a program there is no exit code, so the runtime's message must be in the error."""
    rude.script.calls = [command(NOT_STARTED)]

    with pytest.raises(OSError, match="no such program"):
        run(rude.api)


@pytest.mark.parametrize("ends", ["properly", "broken"])
def test_output_without_the_word_about_success_is_not_whole(rude, ends):
    """A failing node also closes its connections properly, so only the last message proves success."""
    rude.script.calls = [command(b"\x01half", ends=ends)]

    with pytest.raises(Unreachable, match="ended early"):
        run(rude.api)


def test_a_command_that_says_nothing_ends_at_its_deadline(rude):
    """The caller must not wait forever for a silent connection."""
    rude.script.calls = [command(b"\x01half", ends="silent")]
    began = time.monotonic()

    with pytest.raises(Unreachable, match="did not end in time"):
        run(rude.api, within_s=0.5)
    assert time.monotonic() - began < 5


def test_a_command_that_is_not_allowed_is_forbidden(rude):
    """The server refuses a websocket with a normal response, whose message a user must see."""
    rude.script.calls = [refusal(403, "Forbidden")]

    with pytest.raises(Forbidden):
        run(rude.api)


def test_a_server_that_is_not_there_is_unreachable(rude):
    """A proxy responds for a server that is not there, and the user must see the proxy's code."""
    rude.script.calls = [raw(b"", code=502)]

    with pytest.raises(OSError, match="502"):
        run(rude.api)


def test_lines_of_a_log_come_one_by_one(rude):
    """A line may arrive in two pieces, and the last line may lack its newline."""
    rude.script.calls = [stream(b"one\ntw", b"o\nthr\xffee")]

    lines = list(rude.api.logs("lab", "pod", "trainer", tail=3, within_s=5))

    [asked] = rude.script.of(watches=False)
    assert lines == ["one", "two", "thr\ufffdee"]
    assert asked.path == "/api/v1/namespaces/lab/pods/pod/log"
    assert asked.query == {"container": "trainer", "tailLines": "3"}


def test_a_log_that_is_followed_ends_at_its_deadline(rude):
    """Lines from before the deadline must reach the caller."""
    rude.script.calls = [stream(b"one\n", ends="silent")]
    lines = rude.api.logs("lab", "pod", "trainer", follow=True, within_s=0.5)

    assert next(lines) == "one"
    with pytest.raises(Unreachable):
        next(lines)
