"""The times of faults depend only on the seed, the simulator, the run's number, and the fault."""

from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.faults.kinds import FaultEvent, Trigger
from palaestra_sim.faults.parser import parse
from palaestra_sim.faults.schedule import FaultSchedule, Life

STEPS = range(1, 4001)


def happenings(schedule, event=FaultEvent.STEP, numbers=STEPS):
    """Return the numbers of the events with a fault."""
    return [number for number in numbers if schedule.at(event, number)]


def test_a_step_is_one_step(schedule):
    """A person who reproduces a crash needs the fault at exactly this step."""
    assert happenings(schedule("crash:step=2000")) == [2000]


def test_every_means_each_multiple(schedule):
    """`every=1000` means steps 1000, 2000 and so on, so the first multiple counts too."""
    assert happenings(schedule("lost:every=1000")) == [1000, 2000, 3000, 4000]


def test_steps_and_resets_are_counted_apart(schedule):
    """A simulator may fail after a number of resets, however many steps come between them."""
    both = schedule("crash:step=5 crash:reset=7")

    assert happenings(both) == [5]
    assert happenings(both, FaultEvent.RESET) == [7]


def test_a_probability_is_a_share_of_the_steps(schedule):
    """The tolerance is four standard deviations of 4000 draws."""
    share = len(happenings(schedule("crash:probability=0.1"))) / len(STEPS)

    assert 0.08 < share < 0.12


def test_probability_0_is_never_and_1_is_always(schedule):
    """A sweep over probabilities may include 0 and 1."""
    assert happenings(schedule("crash:probability=0")) == []
    assert happenings(schedule("crash:probability=1")) == list(STEPS)


def test_another_life_is_another_draw(schedule):
    """With the same draws, a simulator that crashed would crash at the same step after every restart."""
    lives = [happenings(schedule("crash:probability=0.001", number=number))[:1] for number in range(1, 9)]

    assert len({tuple(it) for it in lives}) > 4


def test_over_many_lives_the_probability_is_what_was_written(schedule):
    """With a probability of 0.05 per step, a simulator runs for 20 steps on average."""
    lengths = [
        happenings(schedule("crash:probability=0.05", number=it), numbers=range(1, 500))[0]
        for it in range(1, 401)
    ]

    assert 16 < sum(lengths) / len(lengths) < 24


def test_equal_simulators_do_not_fail_together(schedule):
    """Simulators of a group share their environment variables, and so the seed; their names differ."""
    first, second = (schedule("crash:probability=0.01", simulator=f"job_r0_collect_{it}a") for it in (0, 1))

    assert happenings(first) != happenings(second)


def test_another_seed_is_another_course(schedule):
    """A person repeats an experiment with the same seed, and varies it with another seed."""
    draws = [happenings(schedule("crash:probability=0.01", seed=seed)) for seed in (1, 2, 1)]

    assert draws[0] == draws[2] != draws[1]


def test_a_fault_that_is_added_changes_no_other(schedule):
    """Two experiments, with and without one fault, can then be compared."""
    alone = schedule("crash:probability=0.01")
    beside = schedule("slow:latency_ms=5,probability=0.5 crash:probability=0.01")
    (crash,) = alone.faults

    assert [it for it in STEPS if crash in beside.at(FaultEvent.STEP, it)] == happenings(alone)


def test_the_draws_are_the_same_in_every_release():
    """A run can be repeated years later; Python's `hash()` would differ from process to process."""
    (fault,) = parse("crash:probability=0.05", "test")
    schedule = FaultSchedule(faults=[fault], life=Life(simulator="robotino", number=1))

    assert happenings(schedule, numbers=range(1, 21)) == [7, 12, 20]


@given(st.integers(1, 10**12), st.integers(0, 2**64))
def test_a_delay_lies_between_latency_and_latency_with_jitter(number, seed):
    """A user reads these bounds from the options: 50 ms, and up to 20 ms more."""
    (fault,) = parse("slow:latency_ms=50,jitter_ms=20", "test")
    schedule = FaultSchedule(faults=[fault], life=Life(seed=seed))

    assert 0.05 <= schedule.delay_s(fault, number) < 0.07


@given(st.integers(1, 10**6), st.integers(1, 1000), st.floats(0, 1, exclude_max=True))
def test_a_trigger_needs_both_its_multiple_and_its_chance(number, every, draw):
    """A trigger fires only if all its conditions hold; a trigger without conditions always fires."""
    assert Trigger(event=FaultEvent.STEP).fires(number, draw)
    assert Trigger(event=FaultEvent.STEP, every=every).fires(number, draw) == (number % every == 0)
    assert Trigger(event=FaultEvent.STEP, at=every).fires(number, draw) == (number == every)
    assert not Trigger(event=FaultEvent.STEP, probability=draw).fires(number, draw)
