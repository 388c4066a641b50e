"""The metrics of a trainer, and where their values come from."""

from __future__ import annotations

import errno
import os
import socket
from types import SimpleNamespace

import numpy as np
import pytest
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families

from palaestra_trainer.episodes.evaluation import Episode, EvaluationResult
from palaestra_trainer.errors import SimulatorDead, SimulatorHung
from palaestra_trainer.run.attempt import Attempt, AttemptDependencies
from palaestra_trainer.run.telemetry import metrics
from palaestra_trainer.run.telemetry.metric_definitions import FAMILIES
from palaestra_trainer.run.telemetry.metric_values import Logged
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.simulators.budget import RestartLimit
from palaestra_trainer.simulators.restarter import Restarter, await_one
from palaestra_trainer.simulators.standby import Standby


@pytest.fixture
def progress(clock):
    """Return the progress of a run with two simulators."""
    return Progress(100, [("collect-0", "Collect"), ("evaluate-0", "Evaluate")], clock)


def scrape(progress, known=None):
    """Return the metric families that Prometheus would parse, by name."""
    text = generate_latest(metrics.registry(progress, known or {})).decode()
    return {family.name: family for family in text_string_to_metric_families(text)}


def values(progress, name, *labels):
    """Return the values of a metric, by the values of these labels; an unknown metric has none."""
    return {
        tuple(sample.labels[label] for label in labels): sample.value
        for family in scrape(progress).values()
        for sample in family.samples
        if sample.name == name
    }


def episode(number, *, success=None):
    """Return the info at the end of an episode with this return."""
    end = {} if success is None else {"is_success": success}
    return {"episode": {"r": float(number), "l": 10 * number}} | end


def test_every_family_is_there_before_anything_happened(progress):
    """A person may make a dashboard before the run, and an unknown value must not be exported as zero."""
    found = scrape(progress)

    assert {name for name in found if name.startswith("palaestra_")} == {
        family.name.removesuffix("_total") for family in FAMILIES
    }
    assert found["palaestra_trainer_evaluation_success_ratio"].samples == []
    assert found["palaestra_trainer_checkpoint_timestamp_seconds"].samples == []


def test_episodes_fall_into_the_buckets_of_their_returns_and_lengths(progress):
    """A mean hides rare failures, so a dashboard needs the distribution of returns and lengths.

    The quantiles are those of the last hundred episodes.
    """
    progress.collected(7, [episode(number) for number in range(1, 6)])

    returns = values(progress, "palaestra_trainer_episode_return_bucket", "le")
    assert (returns["0.0",], returns["1.0",], returns["2.0",], returns["+Inf",]) == (0, 1, 2, 5)
    lengths = values(progress, "palaestra_trainer_episode_length_steps_bucket", "le")
    assert (lengths["5.0",], lengths["10.0",], lengths["20.0",], lengths["50.0",]) == (0, 1, 2, 5)
    assert values(progress, "palaestra_trainer_episode_length_steps_sum") == {(): 150}
    assert values(progress, "palaestra_trainer_episode_return_mean") == {(): 3}
    quantiles = values(progress, "palaestra_trainer_episode_return_quantile", "rank")
    assert quantiles == {("0",): 1, ("0.1",): 1, ("0.5",): 3, ("0.9",): 5, ("1",): 5}


def test_success_in_training_is_that_of_the_last_hundred_episodes(progress):
    """Without reports of success from the environment, the metric has no value."""
    progress.collected(1, [episode(1)])
    silent = values(progress, "palaestra_trainer_episode_success_ratio")
    progress.collected(2, [episode(1, success=False)] * 100)
    progress.collected(3, [episode(1, success=True)] * 25)

    assert silent == {}
    assert values(progress, "palaestra_trainer_episode_success_ratio") == {(): 0.25}


def test_the_metrics_of_an_evaluation_stay_until_the_next(progress):
    """The number of evaluations is a metric too, so a new evaluation with equal values is visible."""
    for success in (True, False):
        played = Episode(seed=1, total_reward=2.0, length=3, success=success)
        progress.evaluated(EvaluationResult(episodes=(played,), faults=0, seconds=0.1))

    assert values(progress, "palaestra_trainer_evaluations_total") == {(): 2}
    assert values(progress, "palaestra_trainer_evaluation_success_ratio") == {(): 0}
    assert values(progress, "palaestra_trainer_evaluation_success_bound_ratio", "bound") == {
        ("low",): 0,
        ("high",): 0.7935,
    }
    assert values(progress, "palaestra_trainer_evaluation_episodes") == {(): 1}
    assert values(progress, "palaestra_trainer_evaluation_return_mean") == {(): 2}
    assert values(progress, "palaestra_trainer_evaluation_length_mean_steps") == {(): 3}


def test_figures_for_tensorboard_are_metrics_too(progress):
    """Losses, exploration and learning rate have metrics; a name of the user's own has none."""
    logged = Logged(progress.figures)
    logged.write({"train/loss": 0.5, "train/n_updates": 4, "rollout/exploration_rate": 0.3}, {}, 7)
    logged.write({"train/learning_rate": 0.001, "train/my_own_loss": 1.0, "train/loss": 0.25}, {}, 8)

    assert values(progress, "palaestra_trainer_loss", "loss") == {("loss",): 0.25}
    assert values(progress, "palaestra_trainer_exploration", "measure") == {("exploration_rate",): 0.3}
    assert values(progress, "palaestra_trainer_learning_rate") == {(): 0.001}


def test_faults_and_restarts_are_counted_by_simulator_and_cause(progress):
    """A restart has the type of the last fault as its cause; a recycling is not a fault."""
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"), steps_lost=0)
    progress.fault("collect-0", SimulatorHung("collect-0", "silent"), steps_lost=0)
    progress.restarted("collect-0", recycled=False)
    progress.restarted("evaluate-0", recycled=True)
    progress.slow("evaluate-0", 0.4)

    faults = values(progress, "palaestra_simulator_faults_total", "simulator", "kind")
    restarts = values(progress, "palaestra_simulator_restarts_total", "simulator", "cause")
    assert {labels for labels, times in faults.items() if times} == {
        ("collect-0", "dead"), ("collect-0", "hung"), ("evaluate-0", "slow"),
    }  # fmt: skip
    assert {labels for labels, times in restarts.items() if times} == {
        ("collect-0", "hung"), ("evaluate-0", "recycled"),
    }  # fmt: skip
    assert (len(faults), len(restarts)) == (8, 8)


def test_simulators_are_counted_by_how_they_stand(progress):
    """The state of a simulator that was given up differs from that of one that restarts."""
    progress.started("evaluate-0")
    progress.given_up("collect-0")

    counted = values(progress, "palaestra_trainer_simulators", "role", "state")
    assert {labels for labels, number in counted.items() if number} == {
        ("Collect", "given_up"), ("Evaluate", "ready"),
    }  # fmt: skip


def test_each_simulator_has_metrics_of_its_steps_and_episodes(progress, make_member, clock):
    """A person finds a slow or broken simulator by its own metrics.

    They count its steps with their durations, its episodes, and the spent part of its restart budget.
    Simulated time is exported if it is known.
    """
    restarter = Restarter(make_member(), RestartLimit(restarts=4), progress, clock)
    progress.figures.meters = {"collect-0": restarter.meter}
    restarter.reset(1)
    restarter.step(1)
    restarter.step(1)
    restarter.begin_restart(SimulatorDead("collect-0", "gone"))
    await_one([restarter])

    steps = values(progress, "palaestra_simulator_step_duration_seconds_count", "simulator")
    assert steps == {("collect-0",): 2}
    assert values(progress, "palaestra_simulator_resets_total", "simulator") == {("collect-0",): 1}
    spent = values(progress, "palaestra_simulator_restart_budget_spent_ratio", "simulator")
    assert spent == {("collect-0",): 0.25}
    assert values(progress, "palaestra_simulator_simulated_seconds_total", "simulator") == {}


def test_a_budget_is_whole_again_when_its_time_has_passed(make_member, clock):
    """The time window is the one by which the simulator would be given up."""
    restarter = Restarter(make_member(), RestartLimit(restarts=2, within_s=60.0), clock=clock)
    restarter.begin_restart(SimulatorDead("collect-0", "gone"))
    await_one([restarter])
    before = restarter.meter.budget_spent
    clock.now = 60.0

    assert (before, restarter.meter.budget_spent) == (0.5, 0.0)


def test_a_member_that_knows_its_simulated_time_is_asked(progress, make_member):
    """Prometheus computes the real-time factor from the simulated time."""
    member = make_member()
    member.simulated_s = 1.92
    progress.figures.meters = {"collect-0": Restarter(member).meter}

    assert values(progress, "palaestra_simulator_simulated_seconds_total", "simulator") == {
        ("collect-0",): 1.92
    }


@pytest.fixture
def train(job, directory, make_member):
    """Return a function that trains with DQN to the end, and returns the progress."""

    def run():
        configuration = job("DQN")
        progress = Progress(configuration.steps, [(it.name, it.role) for it in configuration.simulators])
        around = AttemptDependencies(
            make_members=lambda given: [make_member(it.name) for it in given.simulators],
            environment={},
        )
        end = Attempt(configuration, directory, progress, around).play()
        assert end.code == 0, end.message
        return progress

    return run


def test_a_run_tells_of_its_checkpoints_and_losses(train):
    """A person sees from these metrics whether checkpoints still succeed, and whether the loss falls."""
    progress = train()

    size = values(progress, "palaestra_trainer_checkpoint_size_bytes")[()]
    assert size > 1000
    assert values(progress, "palaestra_trainer_checkpoint_duration_seconds_count")[()] >= 1
    assert values(progress, "palaestra_trainer_checkpoint_timestamp_seconds")[()] > 1.7e9
    assert values(progress, "palaestra_trainer_checkpoint_failures_total") == {(): 0}
    assert values(progress, "palaestra_trainer_loss", "loss").keys() == {("loss",)}
    assert values(progress, "palaestra_trainer_exploration", "measure").keys() == {("exploration_rate",)}
    played = values(progress, "palaestra_simulator_resets_total", "simulator")
    assert played.keys() == {("collect-0",), ("evaluate-0",)}


def test_a_resumed_run_exports_nothing_before_its_step_is_known(job, directory, train):
    """Prometheus would take a jump from 0 for growth.

    Here the port is in use, so nothing is served, and the test reads the progress itself.
    """
    saved = train().step
    with socket.create_server(("127.0.0.1", 0)) as taken:
        configuration = job("DQN", statusAddress=f"127.0.0.1:{taken.getsockname()[1]}")
        progress = Progress(configuration.steps, [(it.name, it.role) for it in configuration.simulators])
        around = AttemptDependencies(make_members=lambda _: [], environment={})
        end = Attempt(configuration, directory, progress, around).play()

    assert "is in use" in end.message
    assert progress.step == saved > 0
    assert progress.counters.episodes > 0


def test_a_checkpoint_that_a_full_disk_refuses_is_counted(train, monkeypatch):
    """The run continues without the checkpoint, but a person should get an alert."""

    def no_space(*_args, **_options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(np, "savez", no_space)

    progress = train()

    assert values(progress, "palaestra_trainer_checkpoint_failures_total")[()] >= 2
    assert values(progress, "palaestra_trainer_checkpoint_size_bytes") == {}


def test_the_limits_of_a_run_are_metrics_too(progress, job):
    """Alerts compare with these limits, for example three checkpoint intervals without a checkpoint."""
    configuration = job(checkpoint={"everySteps": 50}, stallDeadlineSeconds=90)

    found = scrape(progress, metrics.constants(configuration))

    assert found["palaestra_trainer_checkpoint_interval_steps"].samples[0].value == 50
    assert found["palaestra_trainer_stall_deadline_seconds"].samples[0].value == 90


def test_a_member_with_a_spare_has_simulated_what_both_have():
    """A restart swaps simulator and standby, but the counter must not decrease."""
    first, second = (SimpleNamespace(name="collect-0", simulated_s=seconds) for seconds in (1.5, 0.25))

    assert Standby(first, second).simulated_s == 1.75
