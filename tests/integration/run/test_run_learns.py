"""The README's promise, shortened: a TrainingJob becomes a policy that reaches its target."""

import pytest

from tests.bench import learning

SHARE = 0.2  # of the steps, and of the episodes on which the policy is measured


@pytest.mark.minutes(3)
@pytest.mark.timeout(900)
def test_a_fifth_of_move_to_target_learns_to_reach_most_targets():
    """The promise of the README, on episodes that nothing was chosen on, by the function of `make bench`.

    `make e2e` trains all 50,000 steps, twice, and asks for 90 of 100 episodes; `make bench` measures the
    promise itself, 95 of 100, with five seeds. Here 10 of 20 are asked, so that chance fails one run in
    thousands: three seeds measured 18, 17 and 17. A robot that moves by chance reaches 1.
    """
    assert learning.train_and_measure("move-to-target", seed=1, scale=SHARE) >= 0.5
