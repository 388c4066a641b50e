"""The current programs read the files that release 0.1.0 wrote.

The records are in tests/fixtures/0.1.0. A field that a later release adds is written only if it is set. So
the record of a job without newer features has only the fields of 0.1.0.
"""

import json
import re
from datetime import UTC, datetime
from pathlib import Path

import pytest
import yaml

from palaestra.api import as_data, load, validate
from palaestra.decide.validation import accept
from palaestra.local import run_directory
from palaestra.local.outcome import RunOutcome
from palaestra.plan import ClusterLayout, Images, LocalLayout, identified, plan
from palaestra.view.describe import describe
from palaestra_protocol.pod.status import Termination, TrainerStatus
from palaestra_trainer.job import configuration as trainer
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import checkpoint

OLD = Path(__file__).parents[1] / "fixtures" / "0.1.0"
UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
JOBS = sorted(OLD.glob("job-*.json"))
TRAININGS = sorted(OLD.glob("training/*.yaml"))


def name_of(path):
    """Return the name of a record, for the id of a test."""
    return path.stem


def fields(value, path=""):
    """Return the paths of all fields of a document; all items of a list share one path."""
    if isinstance(value, dict):
        return {path}.union(*(fields(item, f"{path}.{key}") for key, item in value.items()))
    if isinstance(value, list):
        return {path}.union(*(fields(item, f"{path}[]") for item in value))
    return {path}


def named(path):
    """Return the fields of a training.yaml, except those whose names the job's author chooses."""
    free = re.compile(r"^\.(algorithm\.hyperparameters|environment\.options)\.")
    return {each for each in fields(path) if not free.match(each)}


@pytest.mark.parametrize("path", JOBS, ids=name_of)
def test_a_job_in_a_cluster_is_looked_after_as_before(path):
    """A new operator must continue jobs that the old operator started or ended."""
    recorded = json.loads(path.read_text())

    job = accept(recorded)

    assert job.status.phase == recorded["status"]["phase"]
    assert job.status.release is not None
    assert job.status.replicas[0].attempt == recorded["status"]["replicas"][0]["attempt"]


@pytest.mark.parametrize("path", JOBS, ids=name_of)
def test_a_job_in_a_cluster_is_shown_as_before(path):
    """A user may upgrade the command line before the operator."""
    recorded = json.loads(path.read_text())
    now = datetime(2026, 11, 23, 5, tzinfo=UTC)

    text = "\n".join(describe(validate(recorded), now, now))

    assert recorded["status"]["phase"] in text
    assert recorded["status"]["replicas"][0]["message"] in text


@pytest.mark.parametrize("path", JOBS, ids=name_of)
def test_a_status_that_uses_nothing_new_has_no_new_field(path):
    """In a cluster with the definition of 0.1.0, the API server drops unknown fields."""
    recorded = json.loads(path.read_text())

    written = as_data(accept(recorded))

    known = set().union(*(fields(json.loads(each.read_text())["status"]) for each in JOBS))
    assert fields(written["status"]) <= known  # empty lists are not written
    assert fields(written["spec"]) == fields(recorded["spec"])


@pytest.mark.parametrize("path", TRAININGS, ids=name_of)
def test_a_training_yaml_is_read_as_it_was(path):
    """After an upgrade of the image, a restarted trainer reads the training.yaml of the old operator."""
    recorded = yaml.safe_load(path.read_text())

    read = trainer.load(path)

    assert (read.job, read.seed, read.steps) == (recorded["job"], recorded["seed"], recorded["steps"])
    assert len(read.simulators) == len(recorded["simulators"])


@pytest.mark.parametrize("path", TRAININGS, ids=name_of)
def test_a_training_yaml_of_a_job_that_uses_nothing_new_has_no_new_field(path):
    """A job may name a trainer image of 0.1.0; that trainer logs a warning for each unknown field."""
    example, layout = path.stem.rsplit(".", 1)
    job = identified(load((OLD / "jobs" / f"{example}.yaml").read_text()), UID)
    images = Images.of_release("0.0.0")
    layouts = {
        "cluster": ClusterLayout(images=images),
        "local": LocalLayout(images=images, job_directory=f"/runs/{job.metadata.name}"),
    }

    planned = plan(job, layouts[layout]).replicas[0].config_map["data"]["training.yaml"]

    assert named(yaml.safe_load(planned)) <= named(yaml.safe_load(path.read_text()))


def test_an_answer_of_status_is_read_and_has_the_same_fields():
    """During an upgrade, an operator and a trainer of different releases communicate."""
    recorded = json.loads((OLD / "trainer-status.json").read_text())

    read = TrainerStatus.from_json(recorded)

    assert (read.step, len(read.simulators)) == (recorded["step"], 3)
    assert fields(read.to_json()) == fields(recorded)


def test_a_last_word_is_read_and_has_the_same_fields():
    """After the end of a pod, its termination message is all that the operator can read."""
    recorded = (OLD / "interrupted" / "termination.json").read_text()

    read = Termination.from_message(recorded)

    assert read.reason.startswith("Interrupted: ")
    assert fields(read.to_json()) == fields(json.loads(recorded))


@pytest.mark.parametrize(
    ("kind", "record"),
    [(TrainerStatus, "trainer-status.json"), (Termination, "interrupted/termination.json")],
)
def test_what_a_newer_trainer_reports_besides_is_ignored(kind, record):
    """A job may name a newer trainer image; that trainer reports fields that this release does not know."""
    known = json.loads((OLD / record).read_text())
    checkpointed = (known["last_checkpoint"] or {}) | {"of_tomorrow": 1}

    newer = known | {
        "of_tomorrow": {"deep": [1]},
        "last_checkpoint": known["last_checkpoint"] and checkpointed,
    }

    assert kind.from_json(newer) == kind.from_json(known)


@pytest.mark.parametrize("run", ["interrupted", "finished"])
def test_a_run_directory_belongs_to_the_same_job_as_before(run):
    """A user resumes an old run with the same job file and a newer `palaestra run`."""
    recorded = yaml.safe_load((OLD / run / run_directory.RECORD).read_text())

    now = run_directory.record_of(validate(recorded))

    run_directory.refuse_another_job(OLD / run, now)
    assert fields(now) == fields(recorded)


def test_a_finished_run_is_known_to_be_finished():
    """`palaestra run` must report the recorded outcome and start no process."""
    outcome = RunOutcome.of(OLD / "finished")

    assert outcome is not None
    assert (outcome.finished, outcome.steps) == (True, 400)


def test_a_checkpoint_of_two_collectors_is_whole_and_of_the_same_run():
    """A newer trainer must be able to resume from this checkpoint."""
    directory = RunDirectory(OLD / "interrupted")

    found = checkpoint.newest(directory.checkpoints)

    word = Termination.from_message((directory.path / "termination.json").read_text())
    assert (found.manifest.step, found.lost) == (word.last_checkpoint.step, frozenset())
    checkpoint.refuse_another_run(found, trainer.load(directory.configuration))


def test_what_a_trainer_writes_of_such_a_run_has_no_new_field():
    """An older `palaestra-eval` reads the training.yaml, and an older trainer reads the checkpoints."""
    directory = RunDirectory(OLD / "interrupted")
    configuration = trainer.load(directory.configuration)
    recorded = checkpoint.newest(directory.checkpoints).manifest

    written = checkpoint.describe(configuration, recorded.step, recorded.counters)

    assert fields(yaml.safe_load(trainer.dump(configuration))) == fields(
        yaml.safe_load(directory.configuration.read_text())
    )
    assert written.algorithm == {
        name: value for name, value in recorded.algorithm.items() if value is not None
    }
    assert written.environment == recorded.environment
