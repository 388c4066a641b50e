"""The syntax of faults, and the messages about mistakes in it."""

import math
from signal import Signals

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.faults import kinds
from palaestra_sim.faults.kinds import FaultEvent, Trigger
from palaestra_sim.faults.parser import KINDS, FaultError, parse


def one(text):
    """Return the fault that a text specifies."""
    (fault,) = parse(text, "test")
    return fault


def test_a_kind_and_its_keys_become_a_fault():
    """Values are converted to base units, for example milliseconds to seconds."""
    fault = one("slow:service=ir1/enable,latency_ms=50,jitter_ms=20,call=3")

    assert fault == kinds.Slow(
        text="slow:service=ir1/enable,latency_ms=50,jitter_ms=20,call=3",
        trigger=Trigger(event=FaultEvent.CALL, at=3),
        service="ir1/enable",
        latency_s=0.05,
        jitter_s=0.02,
    )


def test_blanks_and_new_lines_stand_between_faults():
    """YAML may fold the value of a variable over several lines."""
    faults = parse(" crash:step=2000\n hang:every=5000  ", "test")

    assert [type(it) for it in faults] == [kinds.Crash, kinds.Hang]
    assert parse("", "test") == ()


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_makes_its_own_class(name):
    """The stub distinguishes faults by their class, not by their text."""
    text = f"{name}:latency_ms=1" if KINDS[name].needs else name

    assert type(one(text)) is KINDS[name].make


@pytest.mark.parametrize(
    ("text", "trigger"),
    [
        ("crash", Trigger(event=FaultEvent.STEP)),
        ("crash:step=7", Trigger(event=FaultEvent.STEP, at=7)),
        ("crash:reset=7", Trigger(event=FaultEvent.RESET, at=7)),
        ("crash:every=7", Trigger(event=FaultEvent.STEP, every=7)),
        ("crash:every=7,on=reset", Trigger(event=FaultEvent.RESET, every=7)),
        ("crash:on=reset", Trigger(event=FaultEvent.RESET)),
        ("crash:probability=0.5", Trigger(event=FaultEvent.STEP, probability=0.5)),
        ("hang:service=a/b", Trigger(event=FaultEvent.CALL)),
        ("hang:service=a/b,every=7", Trigger(event=FaultEvent.CALL, every=7)),
        ("hang:service=a/b,step=7", Trigger(event=FaultEvent.STEP, at=7)),
        ("start_refused:start=2", Trigger(event=FaultEvent.START, at=2)),
        ("start_refused:probability=0.5", Trigger(event=FaultEvent.START, probability=0.5)),
    ],
)
def test_the_keys_about_time_make_the_trigger(text, trigger):
    """`every` and `probability` count steps, or calls if a service is named."""
    assert one(text).trigger == trigger


def test_messages_of_all_sensors_are_meant_unless_one_is_named():
    """A fault that corrupts messages without a topic or a service applies to all sensors."""
    assert one("lost").topic == "*"
    assert one("wrong_value").topic == "*"
    assert one("wrong_value:service=a/b").topic == ""
    assert one("wrong_shape:topic=ir1/value").topic == "ir1/value"


def test_a_crash_can_be_any_signal_that_ends_a_simulator():
    """A real simulator crashed with a bus error. SIGTERM asks for an orderly end, so it is not a crash."""
    assert one("crash:signal=SIGBUS").signal is Signals.SIGBUS
    with pytest.raises(FaultError, match="signal is 'SIGTERM'; give one of SIGABRT, SIGBUS"):
        one("crash:signal=SIGTERM")


def test_a_value_may_be_no_number():
    """The narrowest field of a message is a 32-bit float, which can be NaN or infinite, but not 1e300."""
    assert math.isnan(one("wrong_value").value)
    assert one("wrong_value:value=-inf").value == -math.inf
    with pytest.raises(FaultError, match="value is '1e300'; give a number in the range of a 32-bit float"):
        one("wrong_value:value=1e300")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("crsh", "'crsh' is not a fault; use one of crash, exit, hang"),
        ("crash:", None),
        ("crash:step", "'step' has no =; write KEY=VALUE, with commas between"),
        ("crash:step=1,step=2", "step is given twice; remove one"),
        ("crash:step=0", "step is '0'; give a whole number from 1 to 1,000,000,000,000"),
        ("crash:step=-1", "step is '-1'; give a whole number"),
        ("crash:step=²", "step is '²'; give a whole number"),
        ("crash:probability=2", "probability is '2'; give a number from 0 to 1"),
        ("crash:probability=nan", "probability is 'nan'; give a number from 0 to 1"),
        ("crash:step=1,every=2", "every and step both determine when the fault occurs; remove one"),
        ("crash:step=1,on=step", "'on' and 'step' both choose the event to count; remove 'on'"),
        ("crash:on=call", "it cannot occur at a call; use step or reset"),
        ("crash:start=1", "it cannot occur at a start; use step or reset"),
        ("lost:reset=1", "it cannot occur at a reset; use step"),
        (
            "crash:color=red",
            "color is not a key of this fault; use signal, step, reset, every, probability, on",
        ),
        ("lost:service=a/b", "service is not a key of this fault; use topic, step, every, probability, on"),
        ("slow", "it has no duration; add latency_ms=100"),
        ("slow:latency_ms=4000000", "latency_ms is '4000000'; give a number from 0 to 3,600,000"),
        ("wrong_value:service=a,topic=b", "it names both a service and a topic; write a fault"),
        ("hang:service=", "service is ''; give a path below the robot's name, such as ir1/enable"),
        ("exit:code=256", "code is '256'; give a whole number from 0 to 255"),
        ("memory_growth:mib=0", "mib is '0'; give a number from 0.001 to 1,048,576"),
    ],
)
def test_the_error_for_a_wrong_fault_has_place_fact_and_remedy(text, words):
    """The author can correct the mistake without the documentation. A trailing colon is accepted."""
    if words is None:
        assert one(text).trigger == Trigger(event=FaultEvent.STEP)
        return
    with pytest.raises(FaultError) as told:
        one(text)

    assert str(told.value).startswith(f"test: {text}: {words}")


@given(st.text(alphabet="acehlnorstwy_:=,.0123456789-* ²", max_size=40))
def test_any_text_is_a_fault_or_an_error_that_names_it(text):
    """A person may type any text, which must never cause a traceback."""
    told = None
    try:
        faults = parse(text, "test")
    except FaultError as error:
        told = str(error)

    assert told.startswith("test: ") if told else [it.text for it in faults] == text.split()
