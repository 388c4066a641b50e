"""The term of a leader and its end, tested with a given clock and without an API server."""

from hypothesis import given
from hypothesis import strategies as st

from palaestra.cluster.lease_timing import LeaseSpec, ObservedLease, Tenure

seconds = st.floats(min_value=0, max_value=10**6)
durations = st.floats(min_value=1, max_value=3600)


def claim(**changes):
    """Return a lease that one replica of the operator holds."""
    return LeaseSpec(**{"holder": "a", "duration_s": 15.0, "renewed": "1", "transitions": 0} | changes)


@given(duration_s=durations, offset=seconds, sent=seconds, travel=seconds, looked=seconds, now=seconds)
def test_a_leader_has_stopped_before_anyone_can_follow(duration_s, offset, sent, travel, looked, now):
    """Two leaders at the same time could undo each other's writes.

    The clocks of leader and follower differ by `offset`, but run at the same speed.
    """
    tenure = Tenure(sent=sent, duration_s=duration_s)
    follower = ObservedLease()
    # The API server writes a renewal `travel` s after it is sent; the follower reads it `looked` s later.
    seen = sent + travel + looked + offset
    follower.see(claim(duration_s=duration_s), seen)

    assert not (tenure.holds(now) and now + offset >= seen and follower.free(now + offset))


@given(duration_s=durations)
def test_a_leader_stops_while_a_third_of_the_lease_is_left(duration_s):
    """Requests that the leader has already sent must arrive before the lease ends."""
    tenure = Tenure(sent=100.0, duration_s=duration_s)

    assert tenure.holds(100.0)
    assert not tenure.holds(100.0 + duration_s * 0.667)


def test_a_renewal_starts_the_count_anew():
    """While a leader renews its lease, no other operator becomes the leader."""
    sighting = ObservedLease()
    sighting.see(claim(renewed="1"), 0.0)
    sighting.see(claim(renewed="2"), 14.0)

    assert not sighting.free(28.9)
    assert sighting.free(29.0)


def test_seeing_the_same_again_does_not_start_the_count_anew():
    """A dead leader is replaced in time, however often the other operators read its lease."""
    sighting = ObservedLease()
    for moment in range(15):
        sighting.see(claim(), float(moment))

    assert sighting.free(15.0)


def test_a_lease_that_was_given_back_is_free_at_once():
    """If an operator stops, another operator takes over without a pause."""
    sighting = ObservedLease()
    sighting.see(claim(), 0.0)
    sighting.see(claim(holder="", duration_s=1), 0.1)

    assert sighting.free(0.1)


def test_the_times_in_a_lease_are_never_compared_with_a_clock():
    """Clocks may be wrong, so a renewal dated in the year 2000 or 3000 is as valid as any other."""
    sighting = ObservedLease()
    sighting.see(claim(renewed="2000-01-01T00:00:00.000000Z"), 50.0)

    assert not sighting.free(64.9)


def test_a_lease_without_a_spec_is_nobodys():
    """Another program may have written the Lease, and its content must not stop the operator."""
    assert LeaseSpec.read({"metadata": {"name": "x"}}) == LeaseSpec()
    assert ObservedLease().free(0.0)
