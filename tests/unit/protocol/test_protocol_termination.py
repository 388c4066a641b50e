"""The trainer's termination message fits into Kubernetes' limit, and a reader rejects any other text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.control import (
    ProtocolError,
)
from palaestra_protocol.pod.status import (
    CheckpointStatus,
    FaultRecord,
    Termination,
)


@given(reason=st.text(max_size=3000))
def test_the_last_word_fits_in_a_termination_message(reason) -> None:
    """Kubernetes truncates the message at 4096 bytes, and a truncated JSON text cannot be parsed."""
    checkpoint = CheckpointStatus(step=2**53, time="2025-01-31T12:00:00.123456789+00:00")
    word = Termination(step=2**53, reason=reason, success_rate=1 / 3, last_checkpoint=checkpoint)

    message = word.to_message()

    assert len(message.encode()) <= 4096
    assert Termination.from_message(message).last_checkpoint == checkpoint


def test_the_longest_reason_is_cut_and_nothing_else() -> None:
    """A character of this reason takes twelve bytes in JSON; step and success rate must still be complete."""
    message = Termination(step=7, reason="\U0001f916" * 3000, success_rate=0.5).to_message()

    read = Termination.from_message(message)
    assert (read.step, read.success_rate) == (7, 0.5)
    assert 300 < len(read.reason) < 341


@given(data=st.data())
def test_a_last_word_of_any_length_fits_in_a_termination_message(messages, data) -> None:
    """The oldest log lines and faults are left out until the message fits; the reason is cut last."""
    word = data.draw(messages.right(Termination))

    message = word.to_message()

    read = Termination.from_message(message)
    assert len(message.encode()) <= 4096
    assert read.log == word.log[len(word.log) - len(read.log) :]
    assert read.faults == word.faults[len(word.faults) - len(read.faults) :]
    assert read.reason == word.reason or not (read.log or read.faults)


def test_a_long_log_does_not_drive_out_the_faults() -> None:
    """A person who looks for the cause needs the log lines and the faults."""
    fault = FaultRecord(
        time="2025-01-31T12:00:00Z", simulator="collect-0", kind="dead", fact="x" * 150, step=7
    )
    word = Termination(step=7, reason="y" * 500, log=("z" * 200,) * 30, faults=(fault,) * 30)

    read = Termination.from_message(word.to_message())

    assert len(read.log) >= 7
    assert len(read.faults) >= 6
    assert read.reason == word.reason


@pytest.mark.parametrize(
    "lines", ["one line", [7], ["x" * 201], ["x"] * 11, ["\ud800"]], ids=["text", "7", "long", "many", "half"]
)
def test_a_log_that_nobody_of_ours_wrote_is_refused(lines) -> None:
    """The log becomes part of a TrainingJob's status, so its size is limited."""
    content = Termination(step=7, reason="Completed").to_json() | {"log": lines}

    with pytest.raises(ProtocolError, match=r"^log"):
        Termination.from_json(content)


@pytest.mark.parametrize("message", ["", "Traceback (most recent call last):", "{" * 5000, "\ud800"])
def test_the_end_of_a_log_is_no_last_word(message) -> None:
    """With FallbackToLogsOnError, the termination message of a crashed trainer is the end of its log."""
    with pytest.raises(ProtocolError):
        Termination.from_message(message)
