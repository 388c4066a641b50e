"""A run records the commit of its author's code, or none, but never a wrong one."""

import subprocess
import sys

import pytest

from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run.source_commit import source_commit

AUTHOR = ("-c", "user.name=a", "-c", "user.email=a@b")
OURS = "MoveToTargetEnv-v0"


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """Return a repository with an importable module of a job in a folder."""
    (tmp_path / "code").mkdir()
    (tmp_path / "code/lab_task.py").write_text("A = 1\n")
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", ".")
    git(tmp_path, *AUTHOR, "commit", "--quiet", "--message=begin")
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path / "code")])
    return tmp_path


def git(folder, *words):
    """Run git in a folder, and return its output."""
    done = subprocess.run(["git", *words], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


def test_the_commit_is_that_of_the_module_wherever_the_run_starts(repository, tmp_path_factory):
    """A person may start the run in a folder of another repository."""
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    head = git(repository, "rev-parse", "HEAD")

    found = source_commit("lab_task:Env-v0", elsewhere)

    assert found == {"of": "lab_task", "commit": head, "dirty": False}
    assert source_commit(OURS, elsewhere) is None
    assert source_commit(OURS, repository) == found | {"of": "working directory"}


def test_a_variable_of_git_does_not_name_another_repository(repository, monkeypatch, tmp_path_factory):
    """A hook of git sets GIT_DIR, and a run may start in a hook."""
    monkeypatch.setenv("GIT_DIR", str(tmp_path_factory.mktemp("other")))

    assert source_commit("lab_task:Env-v0")["of"] == "lab_task"
    assert source_commit(OURS, repository)["dirty"] is False


@pytest.mark.parametrize("change", ["tracked", "untracked module", "new result"])
def test_code_that_is_not_in_the_commit_makes_it_dirty(repository, change):
    """The code of the commit would not reproduce the policy. New files of results are not code."""
    module = "lab_task"
    if change == "tracked":
        (repository / "code/lab_task.py").write_text("A = 2\n")
    elif change == "untracked module":
        module = "lab_other"
        (repository / "code/lab_other.py").touch()
    else:
        (repository / "runs").mkdir()
        (repository / "runs/model.zip").touch()

    assert source_commit(f"{module}:Env-v0")["dirty"] is (change != "new result")


def test_without_git_or_a_commit_there_is_no_commit(repository, monkeypatch, tmp_path_factory):
    """Most images have no git, and the training must begin all the same."""
    empty = tmp_path_factory.mktemp("empty")
    git(empty, "init", "--quiet")

    assert source_commit(OURS, empty) is None

    monkeypatch.setenv("PATH", "/nowhere")
    assert source_commit(OURS, repository) is None


def test_the_record_of_an_attempt_has_the_commit_of_its_code(tmp_path):
    """The code may change between two attempts of one run."""
    run = RunDirectory(tmp_path)
    source = {"of": "lab_task", "commit": "0" * 40, "dirty": True}

    run.begin_attempt("", "new run")
    run.begin_attempt("", "resumed at step 8", source=source)

    assert [line.get("source") for line in read_lines(run.attempts)] == [None, source]


@pytest.mark.parametrize("module", ["not_a_module_of_any_folder", "sys"])
def test_a_module_without_a_file_is_recorded_by_the_working_directory(repository, module):
    """The run may start from the repository of a module that is imported in another way."""
    found = source_commit(f"{module}:Env-v0", repository)

    assert found["of"] == "working directory"
    assert found["commit"] == git(repository, "rev-parse", "HEAD")
