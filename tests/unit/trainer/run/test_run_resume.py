"""A new attempt finds an interrupted or finished run, and resumes or reports it."""

from __future__ import annotations

import json
import os
import signal

import pytest
from stable_baselines3.common.save_util import load_from_zip_file

from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run import checkpoint


def signal_after(steps, number=signal.SIGTERM):
    """Return a function that sends a signal to this process in its `steps`-th call."""
    calls = iter(range(1, 10_000))

    def step():
        if next(calls) == steps:
            os.kill(os.getpid(), number)

    return step


@pytest.mark.parametrize("name", ["DQN", "PPO", "REINFORCE"])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_a_run_with_a_checkpoint_and_75(play, job, directory, last_word, name, number):
    """The checkpoint has the state of the last rollout boundary, so an incomplete rollout is repeated."""
    code, members = play(job(name), on_step=signal_after(42, number))

    saved = checkpoint.newest(directory.checkpoints).manifest
    assert code == 75
    assert last_word().reason == f"Interrupted: {number.name} received"
    assert 0 < saved.step <= 42 + 4
    assert members["collect-0"].log[-1] == "stop"
    assert not directory.summary.exists()


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_a_long_rollout_does_not_wait_for_its_end_once_a_signal_has_come(play, job, directory, name):
    """A pod has little time after SIGTERM, so the rollout is dropped, and repeated after the resume."""
    long = {"DQN": {"train_freq": 3000, "buffer_size": 50}, "PPO": {"n_steps": 4000, "batch_size": 50}}
    configuration = job(
        name,
        steps=4000,
        algorithm={"name": name, "hyperparameters": long[name]},
        evaluation={"everySteps": 0},
    )
    steps = []

    def step():
        steps.append(1)
        if len(steps) == 42:
            os.kill(os.getpid(), signal.SIGTERM)

    code, _ = play(configuration, on_step=step)

    assert (code, len(steps)) == (75, 42)
    assert checkpoint.newest(directory.checkpoints).manifest.step == 0


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_an_interrupted_run_goes_on_where_it_was(play, job, directory, name):
    """The run ends at the same total and keeps its earlier counts.

    At most the incomplete rollout is repeated.
    """
    configuration = job(name)
    _, before = play(configuration, {"collect-0": {"steps": [5]}}, signal_after(42))
    saved = checkpoint.newest(directory.checkpoints).manifest

    code, after = play(configuration, must_resume=True)

    summary = json.loads(directory.summary.read_text())
    seeds_before, seeds_after = (set(it["collect-0"].env.seeds) for it in (before, after))
    assert code == 0
    assert summary["steps"] == (100 if name == "DQN" else 110)  # 14 valid rows, then 16 per rollout
    assert (summary["attempts"], summary["faults"]) == (2, 1)
    assert len(seeds_before & seeds_after) <= (1 if name == "DQN" else 4)
    reasons = [line["reason"] for line in read_lines(directory.attempts)]
    assert reasons == ["new run", f"resumed at step {saved.step}"]


def test_a_run_is_prolonged_by_another_job(play, job, directory, tmp_path):
    """The new run starts from the last checkpoint of the other run, whose files stay unchanged."""
    play(job())
    found = files_of(directory.path)
    longer = RunDirectory(tmp_path / "longer")

    code, _ = play(job(steps=150, resume_from=str(directory.path)), into=longer)

    assert code == 0
    assert json.loads(longer.summary.read_text())["steps"] == 150
    assert [line["reason"] for line in read_lines(longer.attempts)] == ["resumed at step 100"]
    assert min(line["step"] for line in read_lines(longer.evaluations)) >= 100
    assert files_of(directory.path) == found


def test_a_run_that_prolongs_another_goes_on_from_its_own_checkpoint_once_it_has_one(
    play, job, directory, tmp_path
):
    """The second attempt must not start from the other run's checkpoint again."""
    play(job())
    longer = RunDirectory(tmp_path / "longer")
    prolonging = job(steps=250, resume_from=str(directory.path))
    play(prolonging, on_step=signal_after(60), into=longer)
    saved = checkpoint.newest(longer.checkpoints).manifest

    code, _ = play(prolonging, into=longer)

    reasons = [line["reason"] for line in read_lines(longer.attempts)]
    assert code == 0
    assert 100 < saved.step < 250
    assert reasons == ["resumed at step 100", f"resumed at step {saved.step}"]


def test_a_run_that_is_to_prolong_nothing_is_refused(play, job, directory, tmp_path, last_word):
    """Without the error, the run would begin at step 0, and a person would learn that much later."""
    code, members = play(job(resume_from=str(tmp_path / "empty")))

    assert code == 2
    assert "resumeFrom: " in last_word().reason
    assert "empty has no checkpoint; give the run of another job" in last_word().reason
    assert members == {}
    assert not directory.attempts.exists()


def files_of(folder):
    """Return the bytes of each file in a folder."""
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_the_last_word_has_the_number_of_the_attempt_and_its_restarts(play, job, last_word):
    """The number comes from the run directory, which outlives the pods.

    The restarts are those of this attempt alone.
    """
    play(job("DQN"), {"collect-0": {"steps": [5]}}, signal_after(42))
    first = last_word()

    play(job("DQN"), must_resume=True)

    assert (first.attempt, first.restarts) == (1, 1)
    assert (last_word().attempt, last_word().restarts) == (2, 0)


def test_an_attempt_whose_simulators_never_start_is_on_record(play, job, directory, last_word):
    """A pod has run this attempt, so the next one is the second."""
    code, _ = play(job("DQN"), {"collect-0": {"starts": range(1, 20)}})

    assert code == 80
    assert (last_word().attempt, len(list(read_lines(directory.attempts)))) == (1, 1)


def test_a_finished_run_is_reported_and_not_repeated(play, job, directory, last_word):
    """A restarted pod must not train a finished run again."""
    play(job())

    code, members = play(job())

    assert (code, members) == (0, {})
    assert (last_word().step, last_word().reason) == (100, "Completed: before")
    assert len(list(read_lines(directory.attempts))) == 1


CONSTANT = {"exploration_initial_eps": 0.1, "exploration_final_eps": 0.1}  # `steps` has no effect


@pytest.mark.parametrize(("name", "constant"), [("DQN", CONSTANT), ("PPO", {})])
def test_a_finished_run_that_is_prolonged_is_the_run_that_was_that_long(
    play, job, directory, tmp_path, name, constant
):
    """Steps 96 and 192 are rollout boundaries of both algorithms.

    So a run that ends at step 96 has the state that a longer run has there.
    """
    algorithm = {"name": name, "hyperparameters": job(name).algorithm.hyperparameters | constant}
    at_once = RunDirectory(tmp_path / "at-once")
    play(job(algorithm=algorithm, steps=192), into=at_once)
    play(job(algorithm=algorithm, steps=96))

    code, _ = play(job(algorithm=algorithm, steps=192))

    assert code == 0
    assert json.loads(directory.summary.read_text())["steps"] == 192
    assert [line["reason"] for line in read_lines(directory.attempts)] == ["new run", "resumed at step 96"]
    assert parameters(directory) == parameters(at_once)


def parameters(directory):
    """Return the parameters of the policy in the newest checkpoint."""
    _, found, _ = load_from_zip_file(
        checkpoint.newest(directory.checkpoints).path / "model.zip", device="cpu", load_data=False
    )
    return {name: tensor.tolist() for name, tensor in found["policy"].items()}


def test_a_prolonged_run_is_not_finished_until_it_ends(play, job, directory):
    """The summary of the first end must not pass for the result of the longer run."""
    play(job())

    code, _ = play(job(steps=150), on_step=signal_after(20))

    assert code == 75
    assert not directory.summary.exists()


def test_a_directory_of_another_run_is_refused(play, job, last_word):
    """The error comes before any file is overwritten."""
    play(job("DQN"))

    code, _ = play(job("PPO", steps=200))

    assert code == 2
    assert "use another run directory" in last_word().reason


def test_resuming_nothing_is_refused_if_it_was_asked_for(play, job):
    """A person who types --resume expects a run in this directory."""
    code, _ = play(job(), must_resume=True)

    assert code == 2


@pytest.mark.parametrize(("every", "steps"), [(40, [40, 80, 100]), (1000, [100])], ids=["amid", "final"])
def test_an_evaluation_that_was_cut_is_made_up_for(play, job, directory, every, steps):
    """The policy whose evaluation was interrupted may be the best one."""
    configuration = job(evaluation={"everySteps": every, "episodes": 4})
    code, _ = play(configuration, on_step=signal_after(1), of="evaluate-0")
    cut = list(read_lines(directory.evaluations))

    play(configuration)

    assert (code, cut) == (75, [])
    assert [line["step"] for line in read_lines(directory.evaluations)] == steps


def test_no_evaluation_is_made_twice(play, job, directory):
    """The evaluations of the first attempt are in the run directory, so they need not be played again."""
    play(job(), on_step=signal_after(70))

    play(job())

    assert [line["step"] for line in read_lines(directory.evaluations)] == [40, 80, 100]


def test_the_time_of_an_attempt_that_was_killed_is_kept(play, job, directory):
    """Without this time, a run that was killed would seem to be faster."""
    play(job(), {"collect-0": {"steps": {70: ZeroDivisionError("as good as a kill")}}})
    saved = checkpoint.newest(directory.checkpoints).manifest

    play(job())

    ended = checkpoint.newest(directory.checkpoints).manifest
    assert 0 < saved.step < 70
    seconds = [sum(each.counters["goodput"].values()) for each in (saved, ended)]
    assert 0.0 < seconds[0] < seconds[1]


def test_a_new_run_begins_with_the_policy_of_another_and_resumes_from_its_own(
    play, job, directory, tmp_path, capsys
):
    """A new run counts its steps from 0. A resumed run keeps what it has learned since."""
    play(job())
    tuned = RunDirectory(tmp_path / "tuned")
    tuning = job(initial_policy=str(directory.model))

    first, _ = play(tuning, on_step=signal_after(60), into=tuned)
    began = "".join(capsys.readouterr())
    second, _ = play(tuning, into=tuned)
    resumed = "".join(capsys.readouterr())

    assert (first, second) == (75, 0)
    assert "begins from a policy" in began
    assert "begins from a policy" not in resumed
    reasons = [line["reason"] for line in read_lines(tuned.attempts)]
    assert reasons[0] == "new run"
    assert reasons[1].startswith("resumed at step ")


def test_an_initial_policy_that_does_not_fit_starts_nothing(play, job, directory, tmp_path, last_word):
    """The message has the file and a tensor, and the exit code forbids a retry."""
    play(job("PPO"))
    tuned = RunDirectory(tmp_path / "tuned")

    code, members = play(job("DQN", initial_policy=str(directory.model)), into=tuned)

    assert code == 2
    assert f"initialPolicy: {directory.model}: the tensor q_net." in last_word().reason
    assert all("start" not in member.log for member in members.values())
