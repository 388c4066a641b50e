"""Waits between attempts double up to a cap; a random part spreads the attempts of different clients."""

from hypothesis import given
from hypothesis import strategies as st

from palaestra.cluster.timeouts import Backoff
from palaestra.cluster.workqueue import RETRY

chances = st.floats(min_value=0, max_value=1, exclude_max=True)


@given(failures=st.integers(min_value=-1, max_value=10**9), chance=chances)
def test_a_wait_is_never_shorter_than_half_the_first_nor_longer_than_the_cap(failures, chance):
    """A thousand consecutive failures must cause neither an overflow nor an endless wait."""
    backoff = Backoff(first_s=0.5, cap_s=30, chance=lambda: chance)

    assert 0.25 <= backoff.wait_s(failures) <= 30


@given(failures=st.integers(min_value=1, max_value=100))
def test_without_chance_each_wait_is_twice_the_one_before_until_the_cap(failures):
    """During a lasting problem the API server receives fewer and fewer requests."""
    backoff = Backoff(first_s=0.5, cap_s=30, chance=lambda: 0.0)

    assert backoff.wait_s(failures + 1) == min(2 * backoff.wait_s(failures), 30)


def test_two_clients_that_fail_together_do_not_come_back_together():
    """A random part shortens each wait by up to half, so the retries of many clients are spread."""
    early = Backoff(first_s=1, cap_s=60, chance=lambda: 0.99)
    late = Backoff(first_s=1, cap_s=60, chance=lambda: 0.0)

    assert early.wait_s(5) < 0.6 * late.wait_s(5)


def test_work_that_fails_is_tried_again_after_a_twentieth_of_a_second_to_a_minute():
    """A first retry should cost little time, and a lasting failure few requests.

    docs/reference/operator.md names both bounds.
    """
    waits = [RETRY.wait_s(failures) for failures in range(1, 30)]

    assert min(waits) >= 0.05
    assert max(waits) <= 60
