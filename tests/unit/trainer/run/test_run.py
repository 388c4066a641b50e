"""Complete runs on corridors: steps, evaluations, faults and ends."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import structlog
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.episodes.seeds import CONFIRM, EVALUATE, episode_seeds
from palaestra_trainer.errors import ConfigurationError, MasterLost
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run import attempt, checkpoint
from palaestra_trainer.run.evaluate import measure


@pytest.mark.parametrize(("name", "collectors", "steps"), [("DQN", 1, 100), ("PPO", 2, 128), ("A2C", 1, 100)])
def test_a_run_ends_with_its_steps_a_model_and_a_summary(play, job, directory, name, collectors, steps):
    """DQN and A2C stop at the wanted step, PPO at the end of its rollout."""
    code, _ = play(job(name, collectors=collectors))

    summary = json.loads(directory.summary.read_text())
    assert code == 0
    assert summary["steps"] == steps
    assert summary["faults"] == 0
    assert directory.model.exists()
    assert checkpoint.newest(directory.checkpoints).manifest.step == steps


def test_evaluations_are_lines_of_equal_episodes(play, job, directory):
    """Results can be compared over time only if each evaluation plays the same episodes."""
    _, members = play(job())

    lines = list(read_lines(directory.evaluations))
    seeds, confirming = episode_seeds(1, EVALUATE, 4), episode_seeds(1, CONFIRM, 4)
    assert [line["step"] for line in lines] == [40, 80, 100]
    assert set(lines[0]) >= {"episodes", "success_rate", "mean_return", "mean_length"}
    assert members["evaluate-0"].env.seeds == [*seeds] * 3 + [*confirming]


def test_simulators_rest_while_nobody_needs_them(play, job):
    """Paused simulators leave the processor to the others.

    Evaluators run only in evaluations and in the confirmation, collectors at all other times.
    """
    _, members = play(job())

    assert members["evaluate-0"].log == ["start", "pause", *(["run", "pause"] * 4), "stop"]
    assert members["collect-0"].log == ["start", *(["pause", "run"] * 4), "stop"]


def test_model_zip_is_the_best_by_evaluation(play, job, directory):
    """Measured again on the same seeds, the policy in model.zip has the result of the best evaluation."""
    configuration = job("REINFORCE", steps=600, evaluation={"everySteps": 50, "episodes": 4})
    _, members = play(configuration)
    best = max(read_lines(directory.evaluations), key=lambda it: (it["success_rate"], it["mean_return"]))

    again = measure(
        configuration, directory.model, lambda _: [members["evaluate-0"]], episodes=4, stream=EVALUATE
    )

    assert (again["success_rate"], again["mean_return"]) == (best["success_rate"], best["mean_return"])


def test_training_ends_early_at_the_wanted_success_rate(play, job, directory):
    """The policy learns the corridor long before 5,000 steps."""
    wanted = {"everySteps": 50, "episodes": 4, "stopAtSuccessRate": 1.0}
    code, _ = play(job("REINFORCE", steps=5000, evaluation=wanted))

    summary = json.loads(directory.summary.read_text())
    assert code == 0
    assert summary["success_rate"] == 1.0
    assert summary["steps"] < 5000


@pytest.mark.parametrize("evaluation", [{"everySteps": 0}, {"everySteps": 10}])
def test_without_evaluations_the_last_model_is_kept(play, job, directory, evaluation):
    """Without evaluations, no model is known to be better than the last one."""
    code, _ = play(job(evaluation=evaluation, evaluators=0))

    assert code == 0
    assert directory.model.exists()
    assert json.loads(directory.summary.read_text())["success_rate"] is None


@pytest.mark.parametrize("name", ["DQN", "PPO", "A2C", "REINFORCE"])
def test_faults_are_survived_and_counted(play, job, directory, name):
    """A collector and an evaluator break, and the run still takes all its steps."""
    faults = {"collect-0": {"steps": [5, 30]}, "evaluate-0": {"steps": [6]}}
    code, members = play(job(name), faults)

    summary = json.loads(directory.summary.read_text())
    assert code == 0
    assert (summary["faults"], summary["restarts"]) == (3, 3)
    assert summary["steps"] >= 100
    assert members["collect-0"].log.count("restart") == 2


def test_simulators_are_recycled_without_a_fault(play, job, directory):
    """Recycling comes between two episodes, so no step is lost."""
    code, members = play(job(), {name: {"recycle_after": 5} for name in ("collect-0", "evaluate-0")})

    summary = json.loads(directory.summary.read_text())
    assert code == 0
    assert summary["recycled"] == sum(it.log.count("restart") for it in members.values()) > 2
    assert summary["faults"] == 0


def test_evaluating_simulators_are_recycled_while_the_others_collect(play, job, directory, tmp_path):
    """The restart happens in the background, and the results are those of a run without recycling."""
    recycled, undisturbed = directory, RunDirectory(tmp_path / "undisturbed")
    evaluation = {"everySteps": 20, "episodes": 4, "confirmEpisodes": 0}

    _, members = play(job(evaluation=evaluation), {"evaluate-0": {"recycle_after": 5}}, into=recycled)
    play(job(evaluation=evaluation), into=undisturbed)

    events = members["evaluate-0"].log
    assert events == ["start", "pause", "run", "pause", *["restart", "pause", "run", "pause"] * 4, "stop"]
    assert recycled.evaluations.read_text() == undisturbed.evaluations.read_text()


def test_a_spent_budget_ends_the_run_with_80_and_a_checkpoint(play, job, directory, last_word):
    """Kubernetes does not retry the job, but a person may remove the cause and resume."""
    code, _ = play(job(), {"collect-0": {"steps": range(30, 100)}})

    assert code == 80
    assert last_word().reason.startswith("SimulatorBudgetSpent: collect-0: flapping: 10 restarts")
    assert checkpoint.newest(directory.checkpoints).manifest.step == last_word().last_checkpoint.step > 0


def test_a_simulator_that_does_not_start_is_a_fault_too(play, job):
    """The start is tried again until the budget is spent."""
    code, _ = play(job(), {"collect-0": {"starts": [1, 2]}})

    assert code == 0


def test_a_lost_master_ends_the_run_with_75(play, job, directory, last_word):
    """The simulators would not register with a new master, but a new pod starts new simulators."""
    code, _ = play(job(), {"collect-0": {"steps": {33: MasterLost("no ROS master")}}})

    assert code == 75
    assert "MasterLost" in last_word().reason
    assert checkpoint.newest(directory.checkpoints)


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"algorithm": {"name": "DQN", "hyperparameters": {"gama": 1}}}, "did you mean gamma"),
        ({"statusAddress": "127.0.0.1:99999"}, "statusAddress"),
    ],
)
def test_a_mistake_is_reported_before_a_simulator_is_made(play, job, last_word, changes, fact):
    """The exit code is 2, because a retry cannot help."""
    code, members = play(job(**changes))

    assert (code, members) == (2, {})
    assert fact in last_word().reason


def test_missing_members_are_reported(job, directory, last_word):
    """The function that makes the simulators may have a bug, which must not look like a fault."""
    code = attempt.run(job(), directory, lambda _: [])

    assert code == 2
    assert "collect-0, evaluate-0" in last_word().reason


@pytest.mark.parametrize(
    "algorithm",
    [
        {"name": "A2C", "hyperparameters": {"ent_coef": "lin_0.01"}},
        {"name": "PPO", "hyperparameters": {"batch_size": 1}},
        {"name": "SAC"},
    ],
    ids=["type", "value", "space"],
)
def test_an_algorithm_that_does_not_fit_is_refused_before_a_simulator_starts(play, job, algorithm):
    """Such a job can never train, so the error comes before a simulator starts."""
    code, members = play(job(algorithm=algorithm))

    assert code == 2
    assert [member for member in members.values() if "start" in member.log] == []


@pytest.mark.parametrize("name", ["DQN", "PPO"])
def test_a_run_that_diverges_ends_with_81_and_saves_nothing_of_it(play, job, directory, last_word, name):
    """If a checkpoint contained NaN, every later attempt would start with it."""
    code, _ = play(job(name, steps=2000), step_reward=float("nan"))

    assert code == 81
    assert last_word().reason == (
        "Diverged: episode 0, step 1: collect-0: environment Corridor: the reward is nan (term walk); "
        "fix the environment's reward"
    )
    assert checkpoint.newest(directory.checkpoints) is None


@pytest.mark.parametrize(("name", "step"), [("DQN", 64), ("PPO", 5), ("A2C", 5)])
def test_weights_that_diverge_end_the_run_at_that_update(play, job, directory, last_word, name, step):
    """The checkpoint from before the update is kept, and none is written after it."""
    given = {
        "DQN": {"learning_starts": 60, "batch_size": 8, "train_freq": 4},
        "PPO": {"n_steps": 5, "batch_size": 5},
        "A2C": {"n_steps": 5},
    }
    wild = {"policy_kwargs": {"net_arch": [8]}, "learning_rate": float("inf")}
    algorithm = {"name": name, "hyperparameters": wild | given[name]}

    code, _ = play(job(name, algorithm=algorithm, steps=2000, checkpoint={"everySteps": 50, "keep": 9}))

    newest = checkpoint.newest(directory.checkpoints)
    assert code == 81
    assert re.match(rf"Diverged: step {step}: .*(loss is|holds) (nan|-?inf)", last_word().reason)
    assert (newest.manifest.step if newest else None) == (52 if name == "DQN" else None)


def test_a_last_word_has_the_last_faults(play, job, last_word):
    """The log of a pod is deleted together with the pod."""
    play(job(), {"collect-0": {"steps": [5, 30]}})

    faults = last_word().faults
    assert [(it.simulator, it.kind, it.step) for it in faults] == [
        ("collect-0", "dead", 4),
        ("collect-0", "dead", 28),
    ]
    assert faults[0].fact == "collect-0: died at step 5"


def test_a_summary_says_what_the_wall_clock_went_into(play, job, directory):
    """A person sees which share of the duration trained; the times must add up to the duration."""
    play(job("PPO"), {"collect-0": {"steps": [50]}})

    summary = json.loads(directory.summary.read_text())
    spent = summary["goodput"]
    assert sum(spent.values()) == pytest.approx(summary["duration_s"], abs=0.06)
    assert set(spent) == {cause.value for cause in Cause}
    trained = sum(spent[cause] for cause in ("stepping", "transport", "learning"))
    assert summary["trained_share"] == pytest.approx(trained / sum(spent.values()), abs=0.01)


def test_an_unexpected_error_ends_with_1_and_stops_every_simulator(play, job, last_word):
    """The message has the line of the error, because a person may have no access to the log."""
    bug = {"collect-0": {"steps": {20: ZeroDivisionError("a bug")}}}
    code, members = play(job(), bug)

    assert code == 1
    assert last_word().reason.startswith("Unexpected: ZeroDivisionError: a bug, in /")
    assert all(member.log[-1] == "stop" for member in members.values())


def test_tensorboard_has_the_tags_that_people_look_for(play, job, directory):
    """Scripts of other projects expect the tags of Stable-Baselines3.

    Each reward term has a tag with its name.
    """
    play(job("A2C", steps=600))

    events = EventAccumulator(str(directory.tensorboard))
    events.Reload()
    assert set(events.Tags()["scalars"]) >= {
        "rollout/ep_rew_mean",
        "rollout/success_rate",
        "eval/success_rate",
        "eval/mean_reward",
        "reward/walk",
        "time/fps",
        "simulators/faults",
        "simulators/faults_slow",
        "goodput/learning_s",
        "goodput/evaluating_s",
    }


def in_order(folder):
    """Return TensorBoard's points of a folder in order, even if its files are of the same second."""
    files = sorted(folder.iterdir(), key=lambda it: (int(it.name.split(".")[3]), int(it.suffix[1:])))
    whole = folder.with_name("events.out.tfevents")
    whole.write_bytes(b"".join(file.read_bytes() for file in files))
    events = EventAccumulator(str(whole))
    events.Reload()
    return events


@pytest.mark.parametrize("killed_at", [30, 75], ids=["before the first checkpoint", "after it"])
def test_tensorboard_shows_no_step_twice_when_a_run_was_resumed(play, job, directory, killed_at):
    """After a resume the steps since the checkpoint are repeated, so their first points must be hidden."""
    noisy = job("A2C", checkpoint={"everySteps": 50, "keep": 2}, evaluation={"everySteps": 10, "episodes": 1})
    kill = {"collect-0": {"steps": {killed_at: ZeroDivisionError("as good as a kill")}}}

    assert play(noisy, kill)[0] == 1
    assert play(noisy)[0] == 0

    steps = [event.step for event in in_order(directory.tensorboard).Scalars("eval/success_rate")]
    lines = [line["step"] for line in read_lines(directory.evaluations)]
    assert steps == lines
    assert steps == sorted(set(steps))
    assert steps[-1] >= 100


def test_measuring_needs_a_model(job, directory):
    """A person may evaluate a run before it has a model; the message asks to train first."""
    with pytest.raises(ConfigurationError, match=r"model.zip: does not exist; train first"):
        measure(job(), directory.model, lambda _: [], episodes=1, stream="B")


def test_a_policy_is_measured_where_it_collected_if_nobody_evaluates(play, job, directory, make_member):
    """The end of a run prints the command for this, and not every job has a group with role Evaluate."""
    play(job(evaluators=0))
    reported = []

    with structlog.testing.capture_logs() as logs:
        result = measure(
            job(evaluators=0),
            directory.model,
            lambda given: [make_member(each.name) for each in given.simulators],
            episodes=2,
            stream="B",
            report=reported.append,
        )

    assert reported == [result]
    assert [line["name"] for line in logs if "has role Evaluate" in line["event"]] == ["collect-0"]


def test_a_restored_policy_is_the_policy_that_was_saved(play, job, directory, make_member):
    """If a tensor were lost, the restored policy would get another success rate."""
    play(job())

    result = measure(
        job(), directory.model, lambda _: [make_member("evaluate-0")], episodes=4, stream=EVALUATE
    )

    best = max(line["success_rate"] for line in read_lines(directory.evaluations))
    assert result["success_rate"] == best
    assert np.isfinite(result["mean_return"])
