"""The measurement of false stops reports short holds, and the stops that only a person can end."""

from palaestra_trainer.real_robots.safety import STANDING, SafetyDecision, StopCause
from tests.soak.holds import Holds

STALE = StopCause("stale readings", "", stops=False)
LOST = StopCause("connection lost", "", stops=True)


def test_each_hold_is_counted_with_its_time_and_the_long_and_latched_ones_are_stops():
    """A hold for a single late reading is only reported. A person would see a longer hold as a stop."""
    times = iter((0.0, 1.0, 1.1, 2.0, 2.25, 2.5, 9.0, 9.5))
    holds = Holds(lambda: next(times), period_s=0.192)

    for cause in (None, STALE, None, STALE, STALE, None, LOST, LOST):
        holds.decided(None, SafetyDecision(STANDING, cause))

    assert holds.stops() == {"stale readings": 1, "connection lost": 1}
    assert holds.report()["stale readings"] == {
        "latched": 0,
        "holds": 2,
        "stops": 1,
        "longest_s": 0.5,
        "total_s": 0.6,
    }
    assert holds.report()["connection lost"]["latched"] == 1


def test_a_hold_that_becomes_a_stop_is_two_entries():
    """Old readings hold the robot at first, and the lost connection stops it later."""
    times = iter((0.0, 0.5, 2.0))
    holds = Holds(lambda: next(times), period_s=0.192)

    for cause in (STALE, STALE, LOST):
        holds.decided(None, SafetyDecision(STANDING, cause))

    assert [entry[0] for entry in holds.found] == ["stale readings", "connection lost"]
    assert holds.found[0][2] == 2.0
