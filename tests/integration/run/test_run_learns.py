"""The README's promise, shortened: a TrainingJob becomes a policy that reaches its target."""

import pytest

from tests.bench.learning import success_rate

STEPS = 20_000
RARELY = {"everySteps": 5000, "episodes": 20, "confirmEpisodes": 20}
PATIENCE_S = 1200  # two minutes on two idle processors; the other tests leave it a fifth of them


@pytest.mark.minutes(3)
@pytest.mark.timeout(1500)
def test_two_fifths_of_move_to_target_learn_to_reach_most_targets(run):
    """The promise of the README, on episodes that nothing was chosen on.

    `make e2e` trains all 50,000 steps, twice, and asks for 90 of 100 episodes; `make bench` measures the
    promise itself, 95 of 100, with five seeds. Here 80 are asked, so that chance fails one run in
    thousands: three seeds measured 93 to 95.
    """
    whole = run(steps=STEPS, evaluation=RARELY).start()
    code, output = whole.end(PATIENCE_S)

    assert code == 0, output
    assert whole.summary()["steps"] == STEPS
    assert success_rate(whole.directory) >= 0.80
