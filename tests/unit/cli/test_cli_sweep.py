"""`palaestra sweep`, as far as tests can check it without a run."""

import sys

import pytest
import yaml

from palaestra.cli import main
from tests.jobs import make_job

SWEEP = {
    "apiVersion": "palaestra.dev/v1alpha1",
    "kind": "Sweep",
    "metadata": {"name": "s"},
    "spec": {"job": "job.yaml", "random": {"seed": {"low": 1, "high": 2}}, "trials": 2, "optuna": {}},
}
JOB = make_job("j")


@pytest.fixture
def file(tmp_path):
    """Return the path of a sweep file whose job file is missing."""
    path = tmp_path / "sweep.yaml"
    path.write_text(yaml.safe_dump(SWEEP))
    return path


def test_help_has_its_own_exit_codes(capsys):
    """Exit code 75 of a sweep means the same as that of a run: resume with the same command."""
    with pytest.raises(SystemExit):
        main(["sweep", "--help"])

    out = " ".join(capsys.readouterr().out.split())
    assert "75 interrupted after checkpoints; run the same command to resume" in out
    assert "palaestra.dev/sweep=<sweep>" in out


@pytest.mark.parametrize("option", ["--namespace=lab", "--context=c", "--kubeconfig=k"])
def test_an_option_for_a_cluster_without_one_is_refused(file, option, capsys):
    """A user who forgets `--cluster` would notice only hours later that the sweep runs on the laptop."""
    assert main(["sweep", str(file), option]) == 2

    assert capsys.readouterr().err.startswith("--cluster: is missing; add it")


def test_a_job_that_cannot_be_read_is_named(file, capsys):
    """The job's path is relative to the sweep file, not to the current folder."""
    assert main(["sweep", str(file)]) == 2

    assert capsys.readouterr().err.startswith(f"{file.parent}/job.yaml: No such file or directory; name a")


def test_a_search_without_optuna_names_the_extra(file, tmp_path, monkeypatch, capsys):
    """The error comes before the command creates a folder or starts a trial."""
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))
    monkeypatch.setitem(sys.modules, "optuna", None)
    monkeypatch.delitem(sys.modules, "palaestra.sweeps.optuna_search", raising=False)

    assert main(["sweep", str(file), "--dir", str(tmp_path / "runs")]) == 2

    assert "spec.optuna: needs the package optuna; install palaestra[sweeps]" in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()
