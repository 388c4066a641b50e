"""After a kill, model.zip may have a policy of the killed attempt; no other policy's figures count for it."""

from __future__ import annotations

import json
import zipfile

import pytest
from stable_baselines3.common.save_util import load_from_zip_file
from torch import equal

from palaestra_trainer.algorithms import ModelPolicy
from palaestra_trainer.episodes.seeds import CONFIRM, EVALUATE, episode_seeds
from palaestra_trainer.job.run_directory import append_line, drop_lines, read_lines
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.best_record import RECORD, best_of, measured

EVALUATED = {*episode_seeds(1, EVALUATE, 4)}  # the seeds of every evaluation of these runs
ONCE = {"everySteps": 80, "episodes": 4, "confirmEpisodes": 0}
SLOWER = -0.7  # with this reward for each step, training leads to other policies


def killed_at(step):
    """Return the faults of a run that ends without a checkpoint at a step."""
    return {"collect-0": {"steps": {step: ZeroDivisionError("as good as a kill")}}}


def summary(directory):
    """Return the content of summary.json."""
    return json.loads(directory.summary.read_text())


def test_figures_of_another_policy_of_the_same_step_are_not_those_of_model_zip(play, job, directory):
    """The killed attempt kept its policy of step 80, and the resumed attempt evaluates another one there."""
    play(job(evaluation=ONCE), killed_at(90), report=lambda *_: {"is_success": True})
    kept = best_of(directory)

    play(job(evaluation=ONCE), report=lambda *_: {"is_success": False}, step_reward=SLOWER)

    result = summary(directory)
    assert [line["success_rate"] for line in read_lines(directory.evaluations)] == [0.0, 0.0]
    assert (kept.step, best_of(directory)) == (80, kept)
    assert (result["best_step"], result["success_rate"]) == (80, 1.0)
    assert result["mean_return"] == round(kept.mean_return, 4)
    assert result["success_interval"]["low"] > 0.5


@pytest.fixture
def acted(monkeypatch):
    """Return a list that gets the digest of each policy that acts in an evaluation."""
    digests = []
    predict = ModelPolicy.predict

    def noted(self, *arguments, **options):
        digests.append(checkpoint.digest_of_policy(self.model))
        return predict(self, *arguments, **options)

    monkeypatch.setattr(ModelPolicy, "predict", noted)
    return digests


def test_the_policy_in_model_zip_is_confirmed_and_not_the_last_one_of_the_same_step(
    play, job, directory, acted
):
    """The killed attempt kept its policy of the last step, where the resumed one has another."""
    wanted = {
        "evaluation": {"everySteps": 100, "episodes": 4, "confirmEpisodes": 3},
        "checkpoint": {"everySteps": 60, "keep": 2},
    }
    play(job(steps=200, **wanted), killed_at(110), report=lambda *_: {"is_success": True})
    kept = best_of(directory)
    acted.clear()

    play(job(steps=100, **wanted), report=lambda *_: {"is_success": False}, step_reward=SLOWER)

    [line] = read_lines(directory.confirmations)
    assert (kept.step, line["step"], line["confirmed_at"]) == (100, 100, 100)
    assert (acted[-1], line["policy"]) == (kept.policy, kept.policy)
    assert acted[0] != kept.policy


def test_a_confirmation_of_another_policy_of_the_same_step_does_not_count(play, job, directory):
    """The resumed attempt confirms its policy of step 80, which is worse than the one in model.zip."""
    goal = job(evaluation={"everySteps": 80, "episodes": 4, "stopAtSuccessRate": 0.9, "confirmEpisodes": 10})
    confirming = [*episode_seeds(1, CONFIRM, 30)]
    play(goal, killed_at(90), report=lambda seed, _: {"is_success": seed in EVALUATED})
    good = {*EVALUATED, *confirming[20:]}  # the episodes of the third confirmation

    play(goal, report=lambda seed, _: {"is_success": seed in good}, step_reward=SLOWER)

    lines = [(it["step"], it["confirmed_at"]) for it in read_lines(directory.confirmations)]
    assert lines == [(80, 80), (100, 100), (80, 100)]
    assert (summary(directory)["best_step"], summary(directory)["success_rate"]) == (80, 1.0)


def test_the_record_in_model_zip_is_the_line_of_its_evaluation(play, job, directory):
    """The line is dropped if the run resumes from an earlier step, and the figures of model.zip need it."""
    play(job(evaluation=ONCE))

    best = best_of(directory)
    [line] = [line for line in read_lines(directory.evaluations) if line["step"] == best.step]
    assert best.record == line | {"policy": best.policy}
    assert measured(directory) == best.record


def old_release(directory):
    """Remove the record from model.zip, as in folders of older releases."""
    with zipfile.ZipFile(directory.model) as archive:
        members = {name: archive.read(name) for name in archive.namelist() if name != RECORD}
    with zipfile.ZipFile(directory.model, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def test_a_model_zip_without_a_record_has_the_line_with_its_figures(play, job, directory):
    """Folders of older releases keep their interval, unless the line is one of another policy."""
    play(job(evaluation=ONCE))
    old_release(directory)
    best = best_of(directory)
    [line] = [line for line in read_lines(directory.evaluations) if line["step"] == best.step]

    of_its_line = measured(directory)
    drop_lines(directory.evaluations, lambda _: True)
    append_line(directory.evaluations, line | {"mean_return": line["mean_return"] - 1.0})

    assert of_its_line == line
    assert measured(directory) == {
        "step": best.step,
        "success_rate": best.success_rate,
        "mean_return": best.mean_return,
    }


def test_a_run_continues_over_a_model_zip_without_a_record(play, job, directory):
    """The policy of the older release is the best one, so it is confirmed at the end of the run."""
    wanted = job(evaluation=ONCE | {"confirmEpisodes": 5})
    play(wanted, killed_at(90), report=lambda *_: {"is_success": True})
    old_release(directory)

    code, _ = play(wanted, report=lambda *_: {"is_success": False}, step_reward=SLOWER)

    [line] = read_lines(directory.confirmations)
    assert code == 0
    assert (line["step"], line["confirmed_at"]) == (80, 100)
    assert summary(directory)["success_interval"]["episodes"] == 5


def test_without_evaluations_a_prolonged_run_ends_with_its_last_policy(play, job, directory):
    """No evaluation prefers the policy of the shorter run, so model.zip must not keep it."""
    play(job(evaluation={"everySteps": 0}))

    play(job(steps=200, evaluation={"everySteps": 0}))

    last = checkpoint.newest(directory.checkpoints)
    of_model, of_last = (
        load_from_zip_file(path, load_data=False)[1]["policy"]
        for path in (directory.model, last.path / "model.zip")
    )
    assert last.manifest.step == 200
    assert all(equal(of_model[name], of_last[name]) for name in of_last)
