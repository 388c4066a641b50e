"""The best policy of a run is chosen by evaluations, and its success rate is measured on other episodes."""

from __future__ import annotations

import json
import os
import signal

import pytest
from stable_baselines3.common.save_util import load_from_zip_file
from torch import equal

from palaestra_protocol.pod.status import EvaluationStatus
from palaestra_trainer.episodes.seeds import CONFIRM, EVALUATE, episode_seeds
from palaestra_trainer.job.run_directory import drop_lines, read_lines
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.best_record import best_of
from tests.unit.trainer.run.test_run_resume import signal_after

EVALUATED = {*episode_seeds(1, EVALUATE, 4)}  # the seeds of every evaluation of these runs
GOAL = {"everySteps": 40, "episodes": 4, "stopAtSuccessRate": 0.9}


def lucky(seed, _reached):
    """Report success in the episodes of evaluations, and failure in all others."""
    return {"is_success": seed in EVALUATED}


def summary(directory):
    """Return the content of summary.json."""
    return json.loads(directory.summary.read_text())


def test_a_goal_that_was_reached_by_luck_does_not_end_training(play, job, directory):
    """Of many short evaluations, one reaches the goal by chance."""
    code, _ = play(job(evaluation=GOAL), report=lucky)

    result = summary(directory)
    assert code == 0
    assert result["steps"] == 100
    assert [line["success_rate"] for line in read_lines(directory.evaluations)] == [1.0, 1.0, 1.0]
    assert result["success_rate"] == 0.0
    assert result["success_interval"] == {"low": 0.0, "high": 0.037, "episodes": 100}


def test_each_confirmation_plays_episodes_of_its_own(play, job, directory):
    """If confirmations repeated their episodes, the policy would in the end be chosen by these too."""
    _, members = play(job(evaluation=GOAL | {"confirmEpisodes": 10}), report=lucky)

    confirmed = list(read_lines(directory.confirmations))
    played = [each["seed"] for line in confirmed for each in line["played"]]
    assert [line["step"] for line in confirmed] == [40, 80, 100]
    assert played == [*episode_seeds(1, CONFIRM, 30)]
    assert {*played} & EVALUATED == set()
    assert {*played} <= {*members["evaluate-0"].env.seeds}


def test_a_goal_that_is_confirmed_ends_training_with_the_policy_that_reached_it(play, job, directory):
    """An earlier policy had a better evaluation, but its confirmation failed."""
    configuration = job(steps=400, evaluation=GOAL | {"stopAtSuccessRate": 0.5, "confirmEpisodes": 10})
    confirming = [*episode_seeds(1, CONFIRM, 20)]
    good = {*EVALUATED, *confirming[10:]}  # the episodes of the second confirmation

    play(configuration, report=lambda seed, _: {"is_success": seed in good})

    result = summary(directory)
    assert (result["steps"], result["best_step"]) == (80, 80)
    assert (result["success_rate"], result["success_interval"]["episodes"]) == (1.0, 10)
    assert best_of(directory).step == 80


def test_without_confirmations_an_evaluation_alone_ends_training(play, job, directory):
    """With `confirmEpisodes: 0` the run ends at the first evaluation that reaches the goal."""
    play(job(evaluation=GOAL | {"confirmEpisodes": 0}), report=lucky)

    result = summary(directory)
    assert (result["steps"], result["success_rate"]) == (40, 1.0)
    assert result["success_interval"]["episodes"] == 4
    assert not directory.confirmations.exists()


def test_the_best_policy_is_confirmed_at_the_end_and_the_last_one_is_kept(play, job, directory):
    """A person uses the best policy, which is in model.zip, but a longer run continues from the last one."""
    play(job("REINFORCE", steps=600, evaluation={"everySteps": 50, "episodes": 4, "confirmEpisodes": 7}))

    [line] = read_lines(directory.confirmations)
    newest = checkpoint.newest(directory.checkpoints)
    best, last = (
        load_from_zip_file(path, load_data=False)[1]["policy"]
        for path in (directory.model, newest.path / "model.zip")
    )
    assert (line["step"], line["confirmed_at"]) == (best_of(directory).step, summary(directory)["steps"])
    assert line["step"] < 600
    assert summary(directory)["success_rate"] == line["success_rate"]
    assert not all(equal(best[name], last[name]) for name in best)


def test_an_evaluation_keeps_its_episodes(play, job, directory):
    """A person who doubts a success rate can look at its episodes, and repeat one by its seed."""
    play(job(), report=lambda seed, reached: {"is_success": reached, "outcome": f"of-{seed}"})

    line = next(read_lines(directory.evaluations))
    assert {each["seed"] for each in line["played"]} == EVALUATED
    assert {each["outcome"] for each in line["played"]} == {f"of-{seed}" for seed in EVALUATED}
    assert sum(each["success"] for each in line["played"]) / 4 == line["success_rate"]
    assert sum(each["length"] for each in line["played"]) / 4 == line["mean_length"]
    assert line["success_interval"]["episodes"] == 4


def test_success_that_is_never_reported_is_absent_and_not_zero(play, job, directory, last_word):
    """A user's environment may report no success. The best policy is then the one with the best return."""
    code, _ = play(job(), report=lambda *_: {})

    result = summary(directory)
    assert code == 0
    assert (result["success_rate"], result["success_interval"]) == (None, None)
    assert result["mean_return"] is not None
    assert all(line["success_rate"] is None for line in read_lines(directory.evaluations))
    assert last_word().success_rate is None


def test_a_goal_without_reported_success_ends_the_run_at_its_first_evaluation(play, job, last_word):
    """The run could never reach its goal, and a retry cannot help."""
    code, _ = play(job(evaluation=GOAL), report=lambda *_: {})

    assert code == 2
    assert last_word().step == 40
    assert "stopAtSuccessRate: the environment reports no success" in last_word().reason


def test_success_that_is_reported_and_failure_that_is_not_is_a_rate(play, job, directory):
    """Some environments set `is_success` only when it is true."""
    play(job(), report=lambda seed, _: {"is_success": True} if seed == min(EVALUATED) else {})

    assert next(read_lines(directory.evaluations))["success_rate"] == 0.25


def test_a_confirmation_that_was_cut_is_made_up_for(play, job, directory):
    """A goal that was reached must count even if a signal interrupts its confirmation."""
    steps = iter(range(1, 100_000))
    in_confirmation = 4 * 8 + 3  # an episode of the corridor has eight steps at most

    def cut():
        if next(steps) == in_confirmation:
            os.kill(os.getpid(), signal.SIGTERM)

    goal = job(evaluation=GOAL)
    code, _ = play(goal, report=lambda *_: {"is_success": True}, on_step=cut, of="evaluate-0")
    cut_short = list(read_lines(directory.evaluations))
    play(goal, report=lambda *_: {"is_success": True})

    assert (code, cut_short) == (75, [])
    assert (summary(directory)["steps"], summary(directory)["success_rate"]) == (40, 1.0)
    assert [line["step"] for line in read_lines(directory.confirmations)] == [40]


def test_the_summary_is_that_of_model_zip_also_after_a_resume(play, job, directory):
    """The best model was evaluated later than the checkpoint from which the run resumed."""
    configuration = job(evaluation={"everySteps": 40, "episodes": 4, "confirmEpisodes": 0})
    play(configuration, report=lambda *_: {"is_success": True})
    before = best_of(directory)
    directory.summary.unlink()
    drop_lines(directory.evaluations, lambda _: True)  # a resume from an earlier step drops these lines

    play(configuration, report=lambda *_: {"is_success": False})

    result = summary(directory)
    assert best_of(directory) == before
    assert (result["best_step"], result["success_rate"]) == (before.step, 1.0)


def test_the_last_evaluation_is_reported_and_not_the_confirmation_after_it(play, job, directory, last_word):
    """A sweep compares evaluations, and a confirmation plays other episodes, often of an earlier policy."""
    play(job(evaluation=GOAL), report=lucky)

    *_, line = read_lines(directory.evaluations)
    told = EvaluationStatus(step=100, success_rate=1.0, mean_return=line["mean_return"])
    assert last_word().last_evaluation == told
    assert last_word().success_rate == 0.0


def test_the_last_evaluation_is_known_again_after_a_resume(play, job, last_word):
    """The operator may have lost it, for example with the status of a job that was restored from a backup."""
    play(job(), on_step=signal_after(70))
    before = last_word().last_evaluation
    play(job(), on_step=signal_after(2))
    resumed = last_word().last_evaluation
    play(job())
    play(job())

    assert (before.step, resumed) == (40, before)
    assert (last_word().reason, last_word().last_evaluation.step) == ("Completed: before", 100)


def test_an_evaluation_that_was_cut_is_not_the_last_one(play, job, last_word):
    """The resumed attempt repeats it, and its result may differ."""
    in_confirmation = 4 * 8 + 3  # an episode of the corridor has eight steps at most
    cut = signal_after(in_confirmation)

    play(job(evaluation=GOAL), report=lambda *_: {"is_success": True}, on_step=cut, of="evaluate-0")

    assert last_word().success_rate == 1.0
    assert last_word().last_evaluation is None


@pytest.mark.parametrize(("confirming", "rate"), [(0, 1.0), (4, 0.5)], ids=["evaluated", "confirmed"])
def test_the_last_word_of_a_complete_run_has_the_success_rate_of_its_best_policy(
    play, job, directory, last_word, confirming, rate
):
    """The best policy was measured at step 40, and the evaluations of later policies are worse."""
    steps = []
    good = {*EVALUATED, *episode_seeds(1, CONFIRM, 2)}
    goal = 0.9 if confirming else None  # an evaluation that reaches the goal is confirmed at once

    play(
        job(evaluation=GOAL | {"stopAtSuccessRate": goal, "confirmEpisodes": confirming}),
        on_step=lambda: steps.append(1),
        report=lambda seed, _: {"is_success": len(steps) <= 40 and seed in good},
    )

    result = summary(directory)
    assert [line["success_rate"] for line in read_lines(directory.evaluations)] == [1.0, 0.0, 0.0]
    assert (result["best_step"], result["success_rate"]) == (40, rate)
    assert last_word().success_rate == rate
    assert last_word().success_interval.to_json() == result["success_interval"]


def test_a_run_whose_best_policy_was_confirmed_before_a_kill_ends_with_its_success_rate(
    play, job, directory, last_word
):
    """The resumed attempt evaluates nothing, and the operator reads only the last word."""
    play(job(), report=lambda *_: {"is_success": True})
    directory.summary.unlink()  # as after a kill before the summary

    play(job(), report=lambda *_: {"is_success": False})

    assert len([*read_lines(directory.confirmations)]) == 1
    assert last_word().success_rate == summary(directory)["success_rate"] == 1.0
