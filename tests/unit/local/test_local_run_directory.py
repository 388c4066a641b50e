"""The run directory: its lock, the job to which it belongs, and its files."""

import errno
import json
import os
import shlex
import uuid
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from palaestra.api import validate
from palaestra.local import run_directory
from palaestra.local.errors import RunRefused, StorageFailed
from palaestra.local.files import write
from palaestra.local.outcome import RunOutcome, summary, uses
from tests.failing import failing

JOB = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": {"name": "j"}}
SPEC = {"seed": 1, "replicas": 1, "simulators": [{"name": "a", "startDeadlineSeconds": 60}]}


def record(**changes):
    """Return a recorded job, with changes to its spec."""
    return {"kind": "TrainingJob", "spec": {**SPEC, **changes}}


@pytest.fixture
def directory(tmp_path):
    """Return a run directory in which a job was started."""
    path = tmp_path / "job" / "0"
    run_directory.prepare(path, record())
    return path


def test_the_uid_of_a_job_follows_from_its_place(tmp_path):
    """The same command must resume the same run, and jobs in two directories must not share a uid."""
    here, there = tmp_path / "a", tmp_path / "b"

    assert run_directory.uid_of(here) == run_directory.uid_of(here)
    assert run_directory.uid_of(here) != run_directory.uid_of(there)
    assert uuid.UUID(run_directory.uid_of(here)).version == 5


def test_a_run_goes_on_with_the_job_that_it_was_started_with(directory):
    """To resume a run, a user runs the command with the same file."""
    run_directory.refuse_another_job(directory, record())


def test_more_steps_prolong_a_run_and_change_nothing_else(tmp_path):
    """A user may find after a run that the policy still improves, and can then continue the training."""
    run_directory.prepare(tmp_path, record(trainer={"steps": 100}))
    longer = record(trainer={"steps": 150})

    run_directory.refuse_another_job(tmp_path, longer)

    assert run_directory.is_prolonged(tmp_path, longer)
    assert not run_directory.is_prolonged(tmp_path, record(trainer={"steps": 100}))
    assert not run_directory.is_prolonged(tmp_path / "new", longer)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, "spec.trainer.steps: was 100, is 50; it can only be raised, to prolong the run"),
        ({"seed": 2}, "spec.seed: was 1, is 2"),
    ],
    ids=["fewer steps", "another seed"],
)
def test_what_a_prolonged_run_cannot_change_is_refused(tmp_path, changes, line):
    """A higher step count does not make another change acceptable."""
    run_directory.prepare(tmp_path, record(trainer={"steps": 100}))
    steps = 150 if changes else 50

    with pytest.raises(RunRefused) as refused:
        run_directory.refuse_another_job(tmp_path, record(trainer={"steps": steps}, **changes))

    first, remedy = str(refused.value).splitlines()
    assert first == line
    assert "start a new run with --fresh" in remedy


def test_a_new_directory_takes_any_job(tmp_path):
    """A new directory has no earlier job from which the new one could differ."""
    run_directory.refuse_another_job(tmp_path / "new", record())


def test_a_changed_job_is_refused_with_every_changed_field(directory):
    """A run that was trained under two specs could be explained by neither."""
    changed = record(seed=2, simulators=[{"name": "b", "startDeadlineSeconds": 60}])

    with pytest.raises(RunRefused) as refused:
        run_directory.refuse_another_job(directory, changed)

    lines = str(refused.value).splitlines()
    assert lines[:2] == ["spec.seed: was 1, is 2", "spec.simulators[0].name: was 'a', is 'b'"]
    assert "--fresh" in lines[2]


WRONG = RunOutcome(exit_code=2, reason="ConfigurationWrong: gama: is not known", steps=0)


def test_a_job_that_was_wrong_before_its_first_step_may_be_corrected(directory):
    """The run has not trained a step, so the correction mixes no results."""
    WRONG.keep(directory)

    run_directory.refuse_another_job(directory, record(seed=2))

    assert run_directory.is_correction(directory, record(seed=2))


def test_a_wrong_job_that_runs_again_unchanged_is_no_correction(directory):
    """The user may have corrected her own code instead of the job, so the run directory stays."""
    WRONG.keep(directory)

    assert not run_directory.is_correction(directory, record())


@pytest.mark.parametrize(
    "outcome",
    [
        None,
        replace(WRONG, steps=7),
        replace(WRONG, steps=None),
        replace(WRONG, exit_code=1),
        replace(WRONG, exit_code=75),
    ],
    ids=["killed", "steps", "a program of one's own", "failed", "interrupted"],
)
def test_a_run_that_may_have_trained_is_never_corrected(directory, outcome):
    """The trained steps belong to the spec before the change."""
    if outcome is not None:
        outcome.keep(directory)

    with pytest.raises(RunRefused, match=r"^spec.seed: was 1, is 2\n"):
        run_directory.refuse_another_job(directory, record(seed=2))
    assert not run_directory.is_correction(directory, record(seed=2))


def test_a_run_with_a_checkpoint_is_never_corrected(directory):
    """Only the last attempt was refused, and an earlier attempt has trained."""
    WRONG.keep(directory)
    (directory / "checkpoints" / "5000").mkdir(parents=True)

    with pytest.raises(RunRefused, match="has a run of an earlier version of the job"):
        run_directory.refuse_another_job(directory, record(seed=2))


def test_a_run_that_begins_has_no_outcome_of_the_one_before(directory):
    """If the new run is killed, the old outcome would report an end at step 0."""
    WRONG.keep(directory)

    run_directory.prepare(directory, record())

    assert RunOutcome.of(directory) is None


@pytest.mark.parametrize(
    "change",
    [
        {"replicas": 3},
        {"suspend": True},
        {"backoffLimit": 9},
        {"stallDeadlineSeconds": 5},
        {"simulators": [{"name": "a", "startDeadlineSeconds": 90}]},
    ],
)
def test_what_does_not_change_what_is_learned_may_change(directory, change):
    """Deadlines and the number of replicas may change, as in a cluster."""
    run_directory.refuse_another_job(directory, record(**change))


def test_a_default_that_is_new_since_a_run_began_makes_it_no_other_job(tmp_path):
    """An upgrade between two attempts may add a field, whose default must not count as a change."""
    job = validate({**JOB, "spec": {"trainer": {"algorithm": {"name": "PPO", "normalize": {}}}}})
    old = run_directory.record_of(job)
    del old["spec"]["backoffLimit"], old["spec"]["network"], old["spec"]["simulators"][1]["standby"]
    del old["spec"]["trainer"]["algorithm"]["normalize"]["rewards"]
    run_directory.prepare(tmp_path, old)

    run_directory.refuse_another_job(tmp_path, run_directory.record_of(job))


def test_a_field_that_is_new_since_a_run_began_is_a_change_once_it_is_set(tmp_path):
    """A new field with another value than its default changes the training."""
    old = run_directory.record_of(validate({**JOB, "spec": {}}))
    del old["spec"]["seed"]
    run_directory.prepare(tmp_path, old)

    with pytest.raises(RunRefused, match=r"spec.seed: was 1, is 7\n"):
        run_directory.refuse_another_job(
            tmp_path, run_directory.record_of(validate({**JOB, "spec": {"seed": 7}}))
        )


def test_the_record_of_a_newer_release_is_compared_as_it_stands(tmp_path):
    """If this release does not know a field of the record, the error must name the field."""
    now = run_directory.record_of(validate({**JOB, "spec": {}}))
    run_directory.prepare(tmp_path, {**now, "spec": {**now["spec"], "ofTomorrow": 3}})

    with pytest.raises(RunRefused, match=r"^spec.ofTomorrow: was 3, is absent\n"):
        run_directory.refuse_another_job(tmp_path, now)


def test_all_that_may_change_in_a_cluster_may_change_here():
    """The models mark the fields that may change, for clusters and for this command."""
    assert {"spec.activeDeadlineSeconds", "spec.simulators.startDeadlineSeconds"} < run_directory.MUTABLE
    assert "spec.seed" not in run_directory.MUTABLE


def test_a_field_that_is_new_or_gone_is_a_change():
    """A missing field differs from every value."""
    assert list(run_directory.changed_fields({"a": {"b": 1}}, {"a": {"c": [1]}})) == [
        "a.b: was 1, is absent",
        "a.c[0]: was absent, is 1",
    ]


def test_only_one_runner_at_a_time_has_a_directory(tmp_path):
    """Two trainers in one directory would overwrite each other's checkpoints."""
    path = tmp_path / "job" / "0"

    with (
        run_directory.locked(path),
        pytest.raises(RunRefused, match=rf"process {os.getpid()}"),
        run_directory.locked(path),
    ):
        pass


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_refused(tmp_path, monkeypatch, number):
    """Without locks, two runs could write to one directory.

    Examples are NFS without its lock service and Lustre without `flock`.
    """
    monkeypatch.setattr("fcntl.flock", failing(number))
    path = tmp_path / "job" / "0"

    with pytest.raises(RunRefused) as refused, run_directory.locked(path):
        pass

    fact, _, remedy = str(refused.value).partition("; ")
    assert fact.startswith(f"{path}.lock: the file system has no locks ({os.strerror(number)})")
    assert remedy == "choose a folder on a local disk with --dir"
    assert not path.exists()


def test_a_lock_is_free_again_afterwards(tmp_path):
    """The lock is also released after an error, and by the kernel when the process ends."""
    path = tmp_path / "job" / "0"
    with pytest.raises(ZeroDivisionError), run_directory.locked(path):
        raise ZeroDivisionError

    with run_directory.locked(path):
        assert path.with_name("0.lock").exists()


def test_replicas_are_locked_apart(tmp_path):
    """A user may run two replicas of a job in two terminals."""
    with run_directory.locked(tmp_path / "0"), run_directory.locked(tmp_path / "1"):
        assert (tmp_path / "1.lock").exists()


def test_what_was_there_is_set_aside_not_deleted(directory):
    """A typing error with `--fresh` must not delete a trained policy."""
    first = run_directory.set_aside(directory)
    run_directory.prepare(directory, record(seed=2))
    second = run_directory.set_aside(directory)

    assert [first.name, second.name] == ["0.old-1", "0.old-2"]
    assert yaml.safe_load((first / "job.yaml").read_text()) == record()
    assert run_directory.set_aside(directory) is None


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    """A full disk causes an error only during the write."""
    path = tmp_path / "file"
    write(path, b"old")
    monkeypatch.setattr(os, "fsync", _full)

    with pytest.raises(StorageFailed, match=r"No space left on device; choose another folder"):
        write(path, b"new")

    assert path.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == ["file"]


def _full(_descriptor):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_an_outcome_is_kept_in_the_directory(directory):
    """The command can report a finished run without starting a process."""
    outcome = RunOutcome(exit_code=0, steps=50, success_rate=0.95, faults=1)

    outcome.keep(directory)

    assert RunOutcome.of(directory) == outcome
    assert outcome.finished


@pytest.mark.parametrize("content", [None, "", "{", "[]", '{"exit_code": 0, "other": 1}'])
def test_a_directory_without_a_readable_outcome_is_not_finished(directory, content):
    """Such a run was interrupted, so the same command resumes it."""
    if content is not None:
        (directory / "outcome.json").write_text(content)

    assert RunOutcome.of(directory) is None


def test_the_summary_tells_what_was_measured_and_how_to_look_at_it(directory):
    """At the end of a run, a user looks for the result and for the next commands.

    Values that were not measured are left out.
    """
    for name in ("model.zip", "attempts.jsonl"):
        (directory / name).touch()
    (directory / "tensorboard").mkdir()

    ended = RunOutcome(exit_code=0, steps=50_000, success_rate=0.951, trained_share=0.934)

    lines = summary(ended, directory)

    assert [line.split()[0] for line in lines] == [
        "success",
        "steps",
        "trained",
        "run",
        "see",
        "try",
        "export",
    ]
    assert lines[0].endswith("95%")
    assert lines[1].endswith("50,000")
    assert lines[2].endswith("93% of the wall clock")
    assert lines[4].endswith(f"tensorboard --logdir {directory}/tensorboard")
    assert lines[5].endswith(f"palaestra-eval {directory}")
    assert lines[6].endswith(f"palaestra export {directory} --to onnx")


def test_a_shell_reads_the_commands_of_a_summary_as_they_are_meant(tmp_path):
    """Users copy these commands, and the name of their folder may have spaces."""
    directory = tmp_path / "Ada's runs" / "$HOME `x`" / "0"
    (directory / "tensorboard").mkdir(parents=True)
    for name in ("model.zip", "attempts.jsonl"):
        (directory / name).touch()

    commands = [shlex.split(line[20:]) for line in uses(directory)]

    assert [words[1:] for words in commands] == [
        ["--logdir", f"{directory}/tensorboard"],
        [str(directory)],
        ["export", str(directory), "--to", "onnx"],
    ]
    assert [Path(words[0]).name for words in commands] == ["tensorboard", "palaestra-eval", "palaestra"]


def test_the_summary_has_the_interval_of_the_success_rate(directory):
    """The trainer writes this interval into summary.json."""
    interval = {"low": 0.8882, "high": 0.9785, "episodes": 100}
    (directory / "summary.json").write_text(json.dumps({"success_interval": interval}))

    line = summary(RunOutcome(exit_code=0, success_rate=0.951), directory)[0]

    assert line.endswith("95% (95% interval 89% to 98%, 100 episodes)")


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"success_interval": null}', '{"success_interval": 3}'])
def test_a_summary_without_an_interval_shows_the_rate_alone(directory, content):
    """A user's own program may write any content into a file of this name."""
    (directory / "summary.json").write_text(content)

    assert summary(RunOutcome(exit_code=0, success_rate=0.951), directory)[0].split()[-1] == "95%"


def test_the_summary_of_a_program_of_one_s_own_promises_nothing_that_it_did_not_write(directory):
    """`palaestra-eval` reads only models of the built-in loop, and TensorBoard needs existing curves."""
    (directory / "model.zip").touch()

    lines = summary(RunOutcome(exit_code=0), directory)

    assert [line.split() for line in lines] == [["run", "directory", str(directory)]]
