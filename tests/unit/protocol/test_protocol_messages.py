"""The messages between trainer, sidecar and operator: writing, reading, and rejection of wrong messages."""

import contextlib
import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palaestra_protocol.control import (
    LastExit,
    PlainRequest,
    ProtocolError,
    RobotName,
    SidecarState,
    SimulatorState,
    StopRequest,
)
from palaestra_protocol.fields import MOST_BYTES, decoded
from palaestra_protocol.pod.status import (
    Cause,
    EvaluationStatus,
    ExitCode,
    FaultKind,
    SimulatorStatus,
    SuccessInterval,
    Termination,
    TrainerStatus,
)

SHAPES = [SimulatorState, TrainerStatus, Termination]


@pytest.mark.parametrize("shape", SHAPES)
@given(data=st.data())
@settings(max_examples=50)
def test_what_is_written_is_read_back(messages, shape, data) -> None:
    """The sender writes a message as JSON text, and the receiver reads an equal message."""
    message = data.draw(messages.right(shape))

    assert shape.from_json(json.loads(json.dumps(message.to_json()))) == message


@pytest.mark.parametrize("shape", [*SHAPES, StopRequest, PlainRequest])
@given(data=st.data())
@settings(max_examples=100)
def test_no_json_at_all_breaks_a_reader(messages, shape, data) -> None:
    """A pod may send any JSON; a reader must raise no other error than `ProtocolError`."""
    content = data.draw(messages.anything)

    with contextlib.suppress(ProtocolError):
        shape.from_json(content)


@pytest.mark.parametrize("shape", SHAPES)
@given(data=st.data())
@settings(max_examples=100)
def test_one_wrong_field_breaks_no_reader(messages, shape, data) -> None:
    """A message with a single wrong field passes most checks, so it finds bugs that random JSON misses."""
    content = data.draw(messages.bent(shape))

    try:
        message = shape.from_json(content)
    except ProtocolError:
        return
    json.dumps(message.to_json(), allow_nan=False).encode()


@given(data=st.binary(max_size=200))
def test_no_bytes_break_the_decoder(data) -> None:
    """The bytes come from a socket, so they may be anything."""
    with contextlib.suppress(ProtocolError):
        decoded(data)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"state": "happy"}, "state: 'happy' is not one of idle, starting, ready, stopping, failed"),
        ({"state": 3}, "state: a number is not text"),
        ({"world": "x" * 5000}, "world: has 5000 characters; allowed are 0 to 4096"),
        ({"detail": "\ud800"}, "detail: contains an unpaired surrogate"),
        ({"pid": 0}, "pid: is not between 1 and 4194304"),
        ({"pid": True}, "pid: true or false is not an integer"),
        ({"starts": 1.0}, "starts: a number is not an integer"),
        ({"faults": -1}, "faults: is not between 0 and 9007199254740992"),
        ({"faults": 10**6000}, "faults: is not between 0 and 9007199254740992"),
        ({"rss_bytes": -1}, "rss_bytes: is not between 0 and 9007199254740992"),
        ({"robots": {}}, "robots: an object is not a list"),
        ({"robots": [{}] * 33}, "robots: has 33 entries, more than 32"),
        ({"robots": [7]}, "robots[0]: a number is not an object"),
        ({"robots": [{"robot": "r", "ros_name": ""}]}, "robots[0].ros_name: has 0 characters; allowed are 1"),
        ({"left_out": "Drone"}, "left_out: text is not a list"),
        ({"left_out": ["x" * 201]}, "left_out[0]: has 201 characters; allowed are 0 to 200"),
        ({"left_out": ["x"] * 17}, "left_out: has 17 entries, more than 16"),
        ({"last_exit": {"code": 256}}, "last_exit.code: is not between 0 and 255"),
        ({"last_exit": {"code": 1, "expected": 1}}, "last_exit.expected: a number is not true or"),
    ],
)
def test_a_refusal_names_the_field_and_the_fact(state, changes, message) -> None:
    """A person who reads the error knows the program that sent the message, but not this reader."""
    with pytest.raises(ProtocolError) as refusal:
        SimulatorState.from_json(state().to_json() | changes)

    assert str(refusal.value).startswith(message)


@pytest.mark.parametrize("field", ["state", "driver", "world", "robots", "starts", "faults", "detail"])
def test_a_missing_field_is_named(state, field) -> None:
    """If a missing field got a default value, nobody would notice a broken sidecar."""
    content = state().to_json()
    del content[field]

    with pytest.raises(ProtocolError, match=f"^{field}: is missing$"):
        SimulatorState.from_json(content)


def test_a_sidecar_of_an_older_release_tells_no_memory(state) -> None:
    """`rss_bytes` is then None, and the trainer recycles no simulator because of its memory."""
    content = state(rss_bytes=7).to_json()
    del content["rss_bytes"]

    assert SimulatorState.from_json(content).rss_bytes is None


def test_a_field_that_a_newer_release_added_is_ignored_in_an_answer(state) -> None:
    """The images of one job may be of different releases, so a sidecar may send unknown fields."""
    content = state().to_json() | {"color": "green"}

    assert SimulatorState.from_json(content) == state()


def test_a_field_that_does_not_belong_is_refused_in_a_request() -> None:
    """A misspelled deadline would otherwise be ignored, and the default deadline would apply."""
    with pytest.raises(ProtocolError, match=r"^deadline: is not a field of this request$"):
        StopRequest.from_json({"deadline": 5})


@pytest.mark.parametrize("deadline_s", [-0.1, 3600.1, math.nan, math.inf, 10**400, "5", None, True])
def test_a_deadline_is_a_number_of_seconds_within_an_hour(deadline_s) -> None:
    """A wait must end, and NaN is not a duration."""
    with pytest.raises(ProtocolError, match=r"^deadline_s: "):
        StopRequest.from_json({"deadline_s": deadline_s})


def test_a_deadline_may_be_now() -> None:
    """With a deadline of 0, the sidecar kills at once a simulator that does not respond."""
    assert StopRequest.from_json({"deadline_s": 0}).to_json() == {"deadline_s": 0.0}


def test_an_answer_that_is_too_long_is_not_even_read() -> None:
    """JSON takes many times its size in memory when it is parsed."""
    with pytest.raises(ProtocolError, match=r"^body: 524289 bytes are more than 524288$"):
        decoded(b" " * (MOST_BYTES + 1))


def test_nesting_without_end_is_refused_as_any_other_nonsense() -> None:
    """A JSON parser whose stack overflows raises RecursionError, which is not a ValueError."""
    with pytest.raises(ProtocolError, match=r"^body: is not JSON \(RecursionError\)$"):
        decoded(b"[" * 100_000)


def test_the_longest_messages_fit_in_an_answer(state, status) -> None:
    """A sidecar with many robots, or a trainer with many faults, must still be able to report its state."""
    robot = RobotName(robot="\U0001f916" * 300, ros_name="\U0001f916" * 300, supervisor=True)
    fault = SimulatorStatus(
        name="\U0001f916" * 300, role="Collect", state="ready", last_fault="\U0001f916" * 600
    )
    longest = [
        state(
            robots=(robot,) * 40,
            world="\U0001f916" * 5000,
            detail="\U0001f916" * 600,
            left_out=("\U0001f916" * 300,) * 40,
        ),
        status(simulators=(fault,) * 40, left_out=("\U0001f916" * 300,) * 40),
    ]

    for message in longest:
        assert type(message).from_json(decoded(json.dumps(message.to_json()).encode()))


def test_a_text_that_is_too_long_is_cut_by_its_writer(state) -> None:
    """One long error text must not make the whole state unreadable."""
    read = SimulatorState.from_json(state(detail="x" * 501 + "\ud800").to_json())

    assert read.detail == "x" * 500


@pytest.mark.parametrize(("lines", "read"), [(16, "line 15"), (17, "and 2 more")])
def test_lines_that_do_not_fit_are_counted(state, status, lines, read) -> None:
    """Without the count of omitted lines, a reader would take the shortened list for the whole list."""
    left_out = tuple(f"line {number}" for number in range(lines))

    for message in (state(left_out=left_out), status(left_out=left_out)):
        told = type(message).from_json(message.to_json()).left_out
        assert (len(told), told[0], told[-1]) == (16, "line 0", read)


def test_a_number_that_json_cannot_say_is_not_known(status) -> None:
    """The mean return of a diverged training is NaN, which JSON cannot represent, so the reader gets None."""
    read = TrainerStatus.from_json(status(mean_return=math.nan, steps_per_second=math.inf).to_json())

    assert (read.mean_return, read.steps_per_second) == (None, None)


@pytest.mark.parametrize("share", [-0.01, 1.01])
def test_a_success_rate_is_a_share(status, share) -> None:
    """A reader would take a rate in percent for the rate of a very good policy."""
    with pytest.raises(ProtocolError, match=r"^success_rate: is not between 0 and 1$"):
        TrainerStatus.from_json(status(success_rate=share).to_json())


def test_an_interval_travels_with_its_rate(status) -> None:
    """Without the interval, a success rate of few episodes would look as certain as one of many episodes."""
    interval = SuccessInterval(low=0.25, high=0.75, episodes=20)
    word = Termination(step=1, reason="done", success_interval=interval)

    assert TrainerStatus.from_json(status(success_interval=interval).to_json()).success_interval == interval
    assert Termination.from_message(word.to_message()).success_interval == interval


def test_an_evaluation_is_written_only_after_it_was_made(status) -> None:
    """Release 0.1.0 does not report evaluations, and a reader must not take a missing one for a bad one."""
    evaluation = EvaluationStatus(step=40, mean_return=-1.5)

    assert "last_evaluation" not in status().to_json()
    assert TrainerStatus.from_json(status(last_evaluation=evaluation).to_json()).last_evaluation == evaluation


@pytest.mark.parametrize(
    ("changes", "mistake"),
    [
        ({"low": -0.1}, "low: is not between"),
        ({"high": 2}, "high: is not between"),
        ({"episodes": 0}, "episodes"),
    ],
)
def test_bounds_of_a_success_rate_are_shares(status, changes, mistake) -> None:
    """The operator copies the bounds into a TrainingJob's status, whose schema allows 0 to 1."""
    content = status(success_interval=SuccessInterval(low=0.1, high=0.2, episodes=5)).to_json()
    content["success_interval"] |= changes

    with pytest.raises(ProtocolError, match=mistake):
        TrainerStatus.from_json(content)


@pytest.mark.parametrize("time", ["yesterday", "2025-02-30T00:00:00Z", "2025-01-31", "2025-01-31T12:00:00"])
def test_a_time_is_one_that_kubernetes_takes(status, time) -> None:
    """The operator copies the time into a TrainingJob's status, whose schema requires a date-time."""
    content = status(last_progress=time).to_json()

    with pytest.raises(ProtocolError, match=r"^last_progress: is not a time such as 2025-01-31T12:00:00Z$"):
        TrainerStatus.from_json(content)


@pytest.mark.parametrize("age_s", [-0.1, math.nan, math.inf, 10**400, "5", True])
def test_an_age_is_a_number_of_seconds(status, age_s) -> None:
    """The operator detects stalls by this age, so a negative or an infinite age is rejected."""
    content = status().to_json() | {"last_progress_age_s": age_s}

    with pytest.raises(ProtocolError, match=r"^last_progress_age_s: "):
        TrainerStatus.from_json(content)


def test_a_nested_mistake_says_where_it_is(status) -> None:
    """The list may have sixteen simulators, so the message names the index of the wrong one."""
    good = SimulatorStatus(name="collect-0", role="Collect", state="ready")
    bad = SimulatorStatus(name="collect-1", role="Eval", state="ready")

    with pytest.raises(ProtocolError, match=r"^simulators\[1\]\.role: 'Eval' is not one of Collect, "):
        TrainerStatus.from_json(status(simulators=(good, bad)).to_json())


def test_a_trainer_of_an_older_release_is_understood(status) -> None:
    """The images of one job may be of different releases, so a trainer may lack newer fields."""
    simulator = SimulatorStatus(name="collect-0", role="Collect", state="ready")
    running, ended = status(simulators=(simulator,)).to_json(), Termination(step=7, reason="x").to_json()
    for name in ("faults", "goodput", "steps_lost"):
        del running[name]
    for name in ("flapping", "given_up", "standby"):
        del running["simulators"][0][name]
    for name in ("log", "faults"):
        del ended[name]

    assert TrainerStatus.from_json(running) == status(simulators=(simulator,))
    assert Termination.from_json(ended) == Termination(step=7, reason="x")


def test_a_kind_that_a_newer_release_added_is_ignored_in_a_table(status) -> None:
    """An older operator ignores an unknown kind, like any other unknown field."""
    content = status(faults={"dead": 1, "melted": 2}, goodput={"stepping": 1.5, "dreaming": 9.0}).to_json()

    read = TrainerStatus.from_json(content)

    assert (read.faults, read.goodput) == ({"dead": 1}, {"stepping": 1.5})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"faults": [1]}, r"^faults: a list is not an object$"),
        ({"faults": {"dead": -1}}, r"^faults\.dead: is not between"),
        ({"goodput": {"learning": "long"}}, r"^goodput\.learning: text is not a number$"),
        ({"goodput": {"learning": -0.1}}, r"^goodput\.learning: is not between"),
        ({"steps_lost": 1.5}, r"^steps_lost: a number is not an integer$"),
    ],
)
def test_a_table_says_which_of_its_values_is_wrong(status, changes, message) -> None:
    """The two tables have a dozen numbers, so a person needs the name of the wrong number."""
    with pytest.raises(ProtocolError, match=message):
        TrainerStatus.from_json(status().to_json() | changes)


def test_kinds_and_causes_are_those_of_the_metrics_and_the_status() -> None:
    """Dashboards and the status of a TrainingJob use these names, so they must not change."""
    assert [kind.value for kind in FaultKind] == ["dead", "hung", "slow", "wrong_data"]
    assert [cause.value for cause in Cause] == [
        "stepping",
        "transport",
        "learning",
        "evaluating",
        "checkpointing",
        "starting",
        "recovering",
        "recycling",
    ]


def test_the_exit_codes_are_those_that_a_job_decides_by() -> None:
    """The podFailurePolicy of every plan contains these codes, so trainer and operator must agree on them."""
    assert {code.name: code.value for code in ExitCode} == {
        "DONE": 0,
        "CONFIGURATION": 2,
        "INTERRUPTED": 75,
        "FAULT_BUDGET": 80,
        "DIVERGED": 81,
        "STALLED": 82,
    }


def test_an_end_without_code_and_signal_is_one_that_nobody_saw(state) -> None:
    """A program that could not be started has neither an exit code nor a signal."""
    unseen = LastExit(code=None, signal=None, expected=False)
    failed = state(state=SidecarState.FAILED, last_exit=unseen)

    assert SimulatorState.from_json(failed.to_json()).last_exit == unseen


def test_a_protocol_error_is_a_value_error() -> None:
    """A caller can catch `ValueError` for this error and for other wrong values."""
    assert issubclass(ProtocolError, ValueError)
