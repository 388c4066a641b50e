"""A sweep in a cluster: TrainingJobs with a common label. The tests write the operator's statuses."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import yaml

from palaestra.cluster.resources import TRAINING_JOBS
from palaestra.errors import PalaestraError
from palaestra.sweeps import trial_log
from palaestra.sweeps.cluster_backend import ClusterBackend, NotOfThisSweep
from palaestra.sweeps.grid import trials
from palaestra.sweeps.model import Objective, load
from palaestra.sweeps.optuna_search import OptunaSearch
from palaestra.sweeps.runner import carry_out
from palaestra.sweeps.search import InTurn
from palaestra.sweeps.trial import TrialProgress
from tests.jobs import make_job
from tests.waiting import eventually

JOB = make_job("j", scheduling={"queueName": "trainings"})
PATIENCE_S = 60.0
SUCCESS = Objective.SUCCESS_RATE


@pytest.fixture
def file(tmp_path):
    """Return a function that writes the file of a sweep and returns its path."""

    def write(**spec):
        content = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "Sweep", "metadata": {"name": "s"}}
        (tmp_path / "sweep.yaml").write_text(yaml.safe_dump({**content, "spec": {"job": JOB, **spec}}))
        return tmp_path / "sweep.yaml"

    return write


def replica(index, phase, step=100, rate=None):
    """Return the status of a replica, whose last evaluation had the success rate `rate`."""
    evaluation = {"step": step, "successRate": rate, "meanReturn": -1.0}
    known = {} if rate is None else {"successRate": rate, "lastEvaluation": evaluation}
    return {"index": index, "phase": phase, "step": step, **known}


def test_trials_are_jobs_with_a_label_that_their_queue_runs(file, client, place, tell, tmp_path):
    """The command creates all jobs at once, because the queue decides when they run."""
    sweep = load(file(matrix={"trainer.steps": [100, 200]}, seeds=2))
    search = InTurn(trials(sweep), {})
    with ThreadPoolExecutor(1) as pool:
        carried = pool.submit(
            carry_out, search, ClusterBackend(client, "s", None, print, 0.05), tmp_path, SUCCESS, print
        )
        eventually(lambda: place.get(TRAINING_JOBS, "s-1") or carried.done(), PATIENCE_S)
        jobs = place.api.list(TRAINING_JOBS, place.name, labels="palaestra.dev/sweep=s")
        tell("s-0", "Succeeded", replicas=[replica(n, "Succeeded", rate=0.5 + n / 10) for n in range(2)])
        tell("s-1", "Failed", replicas=[replica(0, "Failed"), replica(1, "Succeeded", rate=0.9)])
        carried.result(PATIENCE_S)

    assert sorted(job["metadata"]["name"] for job in jobs) == ["s-0", "s-1"]
    assert {job["spec"]["scheduling"]["queueName"] for job in jobs} == {"trainings"}
    assert {job["spec"]["replicas"] for job in jobs} == {2}
    ended = trial_log.ended(tmp_path)
    assert {number: found.state for number, found in ended.items()} == {
        0: TrialProgress.COMPLETE,
        1: TrialProgress.FAILED,
    }
    assert ended[0].median(sweep.spec.objective) == 0.55


def test_the_job_of_a_pruned_trial_is_deleted(file, client, place, tell, tmp_path):
    """The pods of a pruned trial would take resources from the other trials."""
    space = {"trainer.steps": {"low": 100, "high": 200}}
    sweep = load(file(random=space, trials=2, optuna={"startupTrials": 1}))
    search, journal = OptunaSearch(sweep, tmp_path), tmp_path / "optuna.journal"
    with ThreadPoolExecutor(1) as pool:
        carried = pool.submit(
            carry_out, search, ClusterBackend(client, "s", 1, print, 0.05), tmp_path, SUCCESS, print
        )
        eventually(lambda: place.get(TRAINING_JOBS, "s-0") or carried.done(), PATIENCE_S)
        tell("s-0", "Running", replicas=[replica(0, "Running", rate=0.9)])
        eventually(lambda: journal.exists() and '"intermediate_value"' in journal.read_text(), PATIENCE_S)
        tell("s-0", "Succeeded", replicas=[replica(0, "Succeeded", rate=0.9)])
        eventually(lambda: place.get(TRAINING_JOBS, "s-1") or carried.done(), PATIENCE_S)
        tell("s-1", "Running", replicas=[replica(0, "Running", rate=0.1)])
        carried.result(PATIENCE_S)

    assert place.get(TRAINING_JOBS, "s-1") is None
    assert place.get(TRAINING_JOBS, "s-0") is not None
    assert trial_log.ended(tmp_path)[1].state is TrialProgress.PRUNED


def test_a_job_that_is_not_of_the_sweep_is_not_touched(file, client, place, tmp_path):
    """A job of another user may have the name of a trial by chance."""
    place.train("s-0")
    before = place.get(TRAINING_JOBS, "s-0")
    search = InTurn(trials(load(file(matrix={"seed": [1]}))), {})

    with pytest.raises(NotOfThisSweep, match="this sweep; give the sweep another name"):
        carry_out(search, ClusterBackend(client, "s", None, print), tmp_path, Objective.SUCCESS_RATE, print)

    assert place.get(TRAINING_JOBS, "s-0") == before


def test_a_namespace_in_the_job_is_that_of_the_command(file, client):
    """If the command looked for its jobs in another namespace, the command would wait forever."""
    [trial] = trials(
        load(file(job={**JOB, "metadata": {"name": "j", "namespace": "x"}}, matrix={"seed": [1]}))
    )

    with pytest.raises(PalaestraError, match=r"metadata\.namespace: is x, but the sweep creates .*; choose"):
        ClusterBackend(client, "s", None, print).check(trial.job)


def test_the_command_shows_a_sweep_that_has_ended_in_the_cluster(file, client, tell, typed, tmp_path):
    """The jobs run without the command, so a user may close it and run it again later."""
    [trial] = trials(load(file(matrix={"seed": [1]})))
    client.apply(trial.job)
    tell("s-0", "Succeeded", replicas=[replica(0, "Succeeded", rate=0.75)])

    code, out, err = typed(
        "sweep", str(tmp_path / "sweep.yaml"), "--cluster", "--dir", str(tmp_path / "runs")
    )

    assert (code, err) == (0, [])
    assert "s-0    1     complete  1/1    0.75          0.75 to 0.75" in out
    assert "best: s-0, seed = 1" in out
