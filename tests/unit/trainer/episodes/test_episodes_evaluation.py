"""The evaluation of a policy: its episodes, faults of simulators, and its end."""

from __future__ import annotations

import pytest

from palaestra_trainer.episodes.evaluation import evaluate, evaluate_on_all
from palaestra_trainer.errors import FaultBudgetSpent
from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.simulators.budget import Group, RestartLimit
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.simulators.restarter import Restarter


class Losses(NullWatcher):
    """A watcher that counts the steps of episodes that a fault cut."""

    steps = 0

    def fault(self, simulator, fault, steps_lost):
        """Add the lost steps."""
        del simulator, fault
        self.steps += steps_lost


class Walker:
    """A policy that walks right if the seed's last digit is even, and otherwise left."""

    def predict(self, observation, state=None, episode_start=None, *, deterministic=False):
        """Return the action, and the state unchanged."""
        assert deterministic
        assert episode_start.shape == (1,)
        return int(round(float(observation[1]) * 10) % 2 == 0), state


def test_every_seed_is_an_episode(make_member):
    """Two of the three seeds are even, so two episodes succeed."""
    member = make_member()

    evaluation = evaluate(Walker(), member, [10, 21, 32])

    assert [episode.seed for episode in evaluation.episodes] == [10, 21, 32]
    assert [episode.success for episode in evaluation.episodes] == [True, False, True]
    assert [episode.length for episode in evaluation.episodes] == [3, 8, 3]
    assert evaluation.success_rate == pytest.approx(2 / 3)
    assert evaluation.mean_length == pytest.approx(14 / 3)
    assert evaluation.mean_return == pytest.approx((0.8 - 0.8 + 0.8) / 3)
    assert member.env.seeds == [10, 21, 32]


def test_an_evaluation_measures_the_whole_task_at_any_time(make_member):
    """With an early stage of a curriculum, the success rate would end the training too soon."""
    member = make_member()

    evaluate(Walker(), member, [10, 20])

    assert member.env.options == {"training_progress": 1.0, "episode": 1}


def test_a_faulted_episode_is_played_again_with_its_seed(make_member):
    """All policies are compared on the same episodes, even if a simulator breaks."""
    member, losses = make_member(steps=[5]), Losses()

    evaluation = evaluate(Walker(), Restarter(member, watcher=losses), [10, 20])

    assert member.env.seeds == [10, 20, 20]
    assert (evaluation.faults, losses.steps) == (1, 1)
    assert evaluation.success_rate == 1.0


def test_a_spent_budget_ends_an_evaluation(make_member):
    """A spent budget also ends training, so an evaluation must not hide it."""
    restarter = Restarter(make_member(steps=range(1, 100)), RestartLimit(restarts=3))

    with pytest.raises(FaultBudgetSpent):
        evaluate(Walker(), restarter, [10])


@pytest.mark.parametrize("evaluators", [1, 2, 3, 5])
def test_several_simulators_share_the_episodes(make_member, evaluators):
    """More evaluators only save time; they must not change the result or its order."""
    restarters = [Restarter(make_member(f"evaluate-{index}")) for index in range(evaluators)]

    evaluation = evaluate_on_all(Walker(), restarters, [10, 21, 32, 43])

    assert [episode.seed for episode in evaluation.episodes] == [10, 21, 32, 43]
    assert evaluation.success_rate == 0.5


def test_an_evaluation_can_be_given_up_between_episodes(make_member):
    """After a signal, a run cannot wait for the rest of a hundred episodes."""
    calls = iter([None, KeyboardInterrupt()])

    def check():
        if (error := next(calls)) is not None:
            raise error

    with pytest.raises(KeyboardInterrupt):
        evaluate(Walker(), make_member(), [10, 20, 30], check)


@pytest.mark.parametrize("first", [True, False])
def test_what_ends_one_simulator_s_episodes_ends_all(make_member, first):
    """After Ctrl-C, the other simulators must not continue with their episodes."""
    broken = Restarter(make_member(steps=range(1, 100)), RestartLimit(restarts=0))
    other = make_member("evaluate-1")
    restarters = [broken, Restarter(other)] if first else [Restarter(other), broken]

    with pytest.raises(FaultBudgetSpent):
        evaluate_on_all(Walker(), restarters, range(10_000))

    assert len(other.env.seeds) < 5_000


def test_the_episodes_of_a_broken_simulator_move_to_the_others(make_member):
    """The evaluation must not wait for the restart of the broken simulator."""
    broken = make_member("evaluate-0", steps=[1], held=True)
    other = make_member("evaluate-1")

    evaluation = evaluate_on_all(Walker(), [Restarter(broken), Restarter(other)], [10, 21, 32, 43])

    assert [episode.seed for episode in evaluation.episodes] == [10, 21, 32, 43]
    assert evaluation.faults == 1
    assert sorted(other.env.seeds) == [10, 21, 32, 43]
    broken.release.set()


@pytest.mark.parametrize("alone", [True, False])
def test_a_simulator_that_is_given_up_leaves_its_episodes_to_the_others(make_member, alone):
    """The other simulators may already have played all their own episodes."""
    group = Group(2, least=1)
    restarters = [
        Restarter(make_member("evaluate-0", steps=range(1, 100)), RestartLimit(restarts=1), group=group),
        Restarter(make_member("evaluate-1"), group=group),
    ]

    for _ in range(2):
        evaluation = evaluate_on_all(Walker(), restarters, [10] if alone else range(20))
        assert len(evaluation.episodes) == (1 if alone else 20)

    assert restarters[1].member.env.seeds


def test_without_any_simulator_left_there_is_no_evaluation(make_member):
    """The evaluation ends with an error, because no simulator would ever play the episodes."""
    restarter = Restarter(make_member(steps=range(1, 100)), RestartLimit(restarts=0), group=Group(2, least=1))

    with pytest.raises(FaultBudgetSpent, match="every evaluating simulator was given up"):
        evaluate(Walker(), restarter, [10])


def test_a_signal_does_not_wait_for_a_simulator_that_is_mended(make_member):
    """A restart may take a minute, several times over, but a pod has little time after SIGTERM."""
    member = make_member(steps=[1], held=True)
    looks = []

    def check():
        looks.append(1)
        if "restart" in member.log and len(looks) > 3:
            raise Interrupted("SIGTERM received")

    with pytest.raises(Interrupted):
        evaluate(Walker(), member, [10], check)
    member.release.set()


def test_more_success_counts_before_more_return(make_member):
    """A policy may collect other rewards without ever succeeding."""
    good, bad = (evaluate(Walker(), make_member(), [seed]) for seed in (10, 21))

    assert good.score > bad.score
    assert good.summary()["success_rate"] == 1.0


def test_a_recurrent_policy_keeps_its_state_over_an_episode_and_begins_the_next_without_it(make_member):
    """An LSTM whose state is lost at each step acts differently from the trained policy."""
    seen = []

    class Counter:
        """A policy whose state is the number of its steps."""

        def predict(self, _observation, state=None, episode_start=None, *, deterministic=False):
            """Walk right, and count the step."""
            assert deterministic
            seen.append((state, episode_start.tolist()))
            return 1, (state or 0) + 1

    evaluate(Counter(), make_member(), [10, 21])

    assert seen == [(None, [True]), (1, [False]), (2, [False])] * 2
