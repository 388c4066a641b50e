"""The effects of faults on requests and messages during one run of a simulator."""

import pytest

from palaestra_sim.faults.fault_state import UNHARMED
from palaestra_sim.faults.kinds import RESET_PATHS, WrongShape, WrongValue

STEP = "robot/time_step"
RESET = "supervisor/simulation_reset"


def texts(ruling):
    """Return the texts of the faults that affect the process."""
    return [it.text for it in ruling.effects]


def test_a_fault_of_the_process_happens_at_its_step(course):
    """Requests other than steps do not advance the step number."""
    life = course("crash:step=2")

    assert texts(life.request("robotino", STEP)) == []
    assert life.request("robotino", "ir1/enable") == UNHARMED
    assert texts(life.request("robotino", STEP)) == ["crash:step=2"]


@pytest.mark.parametrize("path", sorted(RESET_PATHS))
def test_every_way_back_to_the_start_is_a_reset(course, path):
    """A reload of the world counts as a reset too."""
    life = course("crash:reset=2")
    life.request("robotino", RESET)

    assert texts(life.request("robotino", path)) == ["crash:reset=2"]


def test_a_step_of_two_robots_is_counted_once(course):
    """Each robot requests the same simulation step, so only requests of the robot that stepped first count.

    After its controller has ended, the requests of another robot count.
    """
    life = course("crash:step=3")
    asked = [life.request(robot, STEP) for robot in ("supervisor", "robotino", "supervisor", "robotino")]
    assert all(it == UNHARMED for it in asked)

    life.closed("supervisor")

    assert texts(life.request("robotino", STEP)) == ["crash:step=3"]


def test_a_robot_that_ends_and_did_not_count_changes_nothing(course):
    """The steps of the other robot still count."""
    life = course("crash:step=2")
    life.request("supervisor", STEP)
    life.closed("robotino")

    assert life.request("robotino", STEP) == UNHARMED
    assert texts(life.request("supervisor", STEP)) == ["crash:step=2"]


def test_a_slow_step_is_slow_alone(course):
    """A delay at one step must not carry over to the next; two delays of the same step add up."""
    life = course("slow:latency_ms=50,every=2 slow:latency_ms=30,step=4")

    delays = [life.request("robotino", STEP).delay_s for _ in range(4)]

    assert delays == pytest.approx([0, 0.05, 0, 0.08])


def test_a_service_hangs_from_its_step_on(course):
    """A client must also cope with a single service that hangs, so the other services still respond."""
    life = course("hang:service=ir1/enable,step=2")
    assert not life.request("robotino", "ir1/enable").lost
    for _ in range(3):
        assert not life.request("robotino", STEP).lost

    assert life.request("robotino", "ir1/enable").lost
    assert not life.request("robotino", "ir2/enable").lost


def test_a_service_that_hung_at_a_call_never_comes_back(course):
    """As with a thread that is stuck, retries of a client must not succeed in this run."""
    life = course("hang:service=ir1/enable,call=2")

    assert [life.request("robotino", "ir1/enable").lost for _ in range(4)] == [False, True, True, True]


def test_a_service_is_slow_at_its_calls(course):
    """The delay of one call must not slow the next call down."""
    life = course("slow:service=ir1/enable,latency_ms=50,every=2")

    assert [life.request("robotino", "ir1/enable").delay_s for _ in range(4)] == [0, 0.05, 0, 0.05]


def test_a_service_that_hangs_at_a_step_can_be_the_step_itself(course):
    """The step at which the fault begins already gets no response."""
    life = course("hang:service=robot/time_step,step=2")

    assert [life.request("robotino", STEP).lost for _ in range(3)] == [False, True, True]


def test_a_star_counts_the_calls_of_all_its_services_together(course):
    """With a count per service, all sensors would fail at their first call, or none would."""
    life = course("slow:service=ir*/enable,latency_ms=50,call=2")

    assert life.request("robotino", "ir1/enable").delay_s == 0
    assert life.request("robotino", "ir2/enable").delay_s == 0.05


def test_answers_go_wrong_in_the_order_that_was_written(course):
    """The order matters, because a cut can remove the bytes of the value."""
    life = course("wrong_value:service=a wrong_shape:service=a,call=2")

    kinds = [[type(damage) for damage in life.request("robotino", "a").damages] for _ in range(2)]

    assert kinds == [[WrongValue], [WrongValue, WrongShape]]


def test_messages_belong_to_the_step_before_them(course):
    """The fault of a step applies to all messages until the next step."""
    life = course("lost:topic=ir1/value,step=2")
    lost = []
    for _ in range(3):
        life.request("robotino", STEP)
        lost.append([life.message(path).lost for path in ("ir1/value", "ir2/value", "ir1/value")])

    assert lost == [[False, False, False], [True, False, True], [False, False, False]]


def test_a_message_can_be_late_and_wrong_at_once(course):
    """If several faults apply to a message, all of them take effect."""
    life = course("late:latency_ms=20 late:latency_ms=30 wrong_value wrong_shape:topic=ir*")
    life.request("robotino", STEP)

    ruling = life.message("ir1/value")

    assert ruling.delay_s == pytest.approx(0.05)
    assert len(ruling.damages) == 2
    assert not ruling.lost


def test_a_star_is_no_global_topic(course):
    """`*` means topics of sensors. A fault names a global topic such as /clock with its slash."""
    sensors, clock = course("lost"), course("lost:topic=/clock")
    for life in (sensors, clock):
        life.request("robotino", STEP)

    assert [sensors.message(path).lost for path in ("ir1/value", "/clock")] == [True, False]
    assert [clock.message(path).lost for path in ("ir1/value", "/clock")] == [False, True]


@pytest.mark.parametrize(
    ("text", "number", "refused", "delay_s"),
    [
        ("start_refused", 5, True, 0.0),
        ("start_refused:start=2", 2, True, 0.0),
        ("start_refused:start=2", 3, False, 0.0),
        ("slow_start:latency_ms=500,every=2", 4, False, 0.5),
        ("crash:step=1", 1, False, 0.0),
    ],
)
def test_starts_are_numbered_by_life(course, text, number, refused, delay_s):
    """The number of a run is also that of its start, so `start=2` affects only the second start."""
    fault, wait_s = course(text, number=number).start()

    assert (fault is not None, wait_s) == (refused, delay_s)


def test_a_life_without_anything_due_is_unharmed(course):
    """Most requests and messages have no fault, and must pass unchanged."""
    life = course("crash:step=1000")

    assert life.request("robotino", STEP) == UNHARMED
    assert life.message("ir1/value") == UNHARMED
