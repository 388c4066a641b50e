"""A damaged run directory ends an attempt with one message, before anything starts or is deleted."""

from __future__ import annotations

import re
import shutil
import zipfile
from pathlib import Path

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory, append_line
from palaestra_trainer.run import checkpoint
from tests.unit.trainer.run.test_run_resume import signal_after


@pytest.fixture(scope="module")
def begun_once(tmp_path_factory):
    """Return a run directory that the fixture `begun` fills once for all tests."""
    return RunDirectory(tmp_path_factory.mktemp("begun") / "run")


@pytest.fixture
def begun(begun_once, play, job, directory):
    """Return a copy of a run that was interrupted after its first checkpoints and evaluations."""
    if not begun_once.path.exists():
        play(job("PPO"), on_step=signal_after(60), into=begun_once)
    shutil.copytree(begun_once.path, directory.path)
    return directory


def written(name, content):
    """Return a function that overwrites a file of a run."""
    return lambda run: (run.path / name).write_bytes(content)


def appended(name, content):
    """Return a function that appends to a file of a run."""

    def damage(run):
        with (run.path / name).open("ab") as file:
            file.write(content)

    return damage


def halved(name):
    """Return a function that cuts 1000 bytes off the end of a file."""
    return lambda run: (run.path / name).write_bytes((run.path / name).read_bytes()[:-1000])


def another_kind(name):
    """Return a function that puts a folder in place of a file, or a file in place of a folder."""

    def damage(run):
        path = run.path / name
        if path.is_dir():
            shutil.rmtree(path)
            path.touch()
        else:
            path.unlink(missing_ok=True)
            path.mkdir()

    return damage


def with_member(wrong):
    """Return a function that puts a member without the fields of an evaluation into model.zip."""

    def damage(run):
        with zipfile.ZipFile(run.model) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        with zipfile.ZipFile(run.model, "w") as archive:
            for name, content in (members | {wrong: b'{"step": "x"}'}).items():
                archive.writestr(name, content)

    return damage


def in_each_checkpoint(name, content):
    """Return a function that overwrites a file in each checkpoint, or deletes it if the content is None."""

    def damage(run):
        for folder in run.checkpoints.iterdir():
            if content is None:
                (folder / name).unlink()
            else:
                (folder / name).write_bytes(content)

    return damage


LINES = ("evaluations.jsonl", "confirmations.jsonl", "attempts.jsonl")
WRONG_LINES = {
    "not UTF-8": b"\xff\xfe\n",
    "a text": b'{"step": "x", "confirmed_at": "x", "episodes": "x", "reason": 1}\n',
    "no field": b'{"a": 1}\n',
    "nothing": b"null\n",
    "a number of 5,000 digits": b'{"step": ' + b"9" * 5000 + b"}\n",
}
DOCUMENTS = ("hyperparameters.json", "trackers.json", "summary.json")
WRONG_DOCUMENTS = {"empty": b"", "a list": b"[1]", "not UTF-8": b"\xff", "cut short": b'{"a": '}
FILES = (*LINES, *DOCUMENTS, "model.zip", "training.yaml", "checkpoints", "tensorboard")
DAMAGES = (
    {f"{name}: {what}": (name, appended(name, text)) for name in LINES for what, text in WRONG_LINES.items()}
    | {
        f"{name}: {what}": (name, written(name, text))
        for name in DOCUMENTS
        for what, text in WRONG_DOCUMENTS.items()
    }
    | {f"{name}: another kind": (name, another_kind(name)) for name in FILES}
    | {
        "model.zip: empty": ("model.zip", written("model.zip", b"")),
        "model.zip: cut short": ("model.zip", halved("model.zip")),
        "model.zip: its evaluation": ("model.zip", with_member("evaluation.json")),
        "model.zip: its record": ("model.zip", with_member("evaluation-record.json")),
        "summary.json: a rate of 2": (
            "summary.json",
            written("summary.json", b'{"target": 9, "steps": 9, "success_rate": 2.0}'),
        ),
        "all manifests empty": ("checkpoints", in_each_checkpoint("manifest.json", b"")),
        "all manifests gone": ("checkpoints", in_each_checkpoint("manifest.json", None)),
        "all models cut short": ("checkpoints", in_each_checkpoint("model.zip", b"PK")),
    }
)


def content_of(folder: Path):
    """Return the bytes of each file below a folder."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(("name", "damage"), DAMAGES.values(), ids=DAMAGES)
def test_a_damage_ends_the_attempt_before_anything_starts_or_is_deleted(
    begun, play, job, last_word, name, damage
):
    """Without the check, an attempt would end with a traceback, replace old files, or fail hours later."""
    damage(begun)
    before = content_of(begun.path)

    code, members = play(job("PPO"))

    assert code == 2
    said = last_word().reason
    assert re.match(rf"ConfigurationWrong: {begun.path / name}: ", said)
    assert "move the run directory away to start a new run" in said
    assert content_of(begun.path) == before
    assert not any(member.log for member in members.values())


HARMLESS = {
    "a line that a crash cut short": appended("evaluations.jsonl", b'{"step": 1'),
    "no line at all": written("confirmations.jsonl", b""),
    "journal.json: a number beyond all": written(
        "journal.json", b'{"step": 1e400, "counters": {"seconds": 1e9}}'
    ),
    "journal.json: lost": written("journal.json", b""),
    "a folder of another name": lambda run: (run.checkpoints / "\u00b2").mkdir(),
}


@pytest.mark.parametrize("damage", HARMLESS.values(), ids=HARMLESS)
def test_what_a_crash_may_leave_is_no_damage(begun, play, job, damage):
    """A crash of the machine may truncate such files, and the run still resumes from its checkpoint."""
    damage(begun)

    code, _ = play(job("PPO"), must_resume=True)

    assert code == 0


def test_no_checkpoint_and_none_that_can_be_read_are_two_answers(begun):
    """With no checkpoint a new run begins.

    Over damaged checkpoints no run may begin, because it would replace them.
    """
    in_each_checkpoint("model.zip", b"PK")(begun)

    assert checkpoint.newest(begun.path / "none") is None
    with pytest.raises(ConfigurationError, match="no checkpoint in it can be read"):
        checkpoint.newest(begun.checkpoints)


def test_appending_a_line_reads_no_more_of_a_longer_file(tmp_path, monkeypatch):
    """If each append read the file, two thousand evaluations would read 11 GiB in total."""
    path = tmp_path / "evaluations.jsonl"
    monkeypatch.setattr(Path, "read_bytes", None)
    monkeypatch.setattr(Path, "read_text", None)
    path.write_bytes(b'{"step": 1}\n{"torn')

    append_line(path, {"step": 2})
    append_line(path, {"step": 3})

    with path.open("rb") as file:
        assert file.read() == b'{"step": 1}\n{"torn\n{"step": 2}\n{"step": 3}\n'
