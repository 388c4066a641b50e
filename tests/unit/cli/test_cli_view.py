"""`palaestra view` refuses a run that it cannot show, with one message, before it opens a page."""

import pytest
import yaml

from palaestra.cli import main
from palaestra.live_view import view_process
from palaestra_protocol.http import Address, Server


@pytest.fixture
def run(tmp_path):
    """Yield the folder of a run whose sidecar, of an older release, has no endpoint for the view."""
    server = Server(Address("127.0.0.1", 0), {}, name="test")
    server.start()
    content = {
        "statusAddress": "127.0.0.1:9",
        "simulators": [{"name": "collect-0", "control": f"http://{server.address}"}],
    }
    (tmp_path / "training.yaml").write_text(yaml.safe_dump(content))
    yield str(tmp_path)
    server.close()


def test_a_missing_library_is_named_with_the_command_that_installs_it(run, monkeypatch, capsys):
    """Viser is an optional extra, because pods and servers do not need it."""
    monkeypatch.setattr(view_process, "find_spec", lambda _name: None)

    assert main(["view", run]) == 2
    assert capsys.readouterr().err == (
        "a view needs the package viser, which is not installed; install it: pip install 'palaestra[view]'\n"
    )


def test_another_simulator_is_refused_with_the_known_ones(run, capsys):
    """The user must learn which simulators the run has."""
    assert main(["view", run, "--simulator", "collect-7"]) == 2
    assert (
        capsys.readouterr().out
        == "--simulator collect-7: the run has no such simulator; use one of collect-0\n"
    )


def test_a_folder_without_a_run_is_refused(tmp_path, capsys):
    """An argument with a slash is always a folder.

    The command must not look for a job of this name in a cluster.
    """
    assert main(["view", str(tmp_path)]) == 2
    assert "has no training.yaml, so it is not a run directory" in capsys.readouterr().err


def test_a_name_that_is_no_folder_is_looked_up_in_the_cluster_and_that_is_said(tmp_path, capsys):
    """A person who mistypes a folder would otherwise read only an error about a kubeconfig."""
    empty = tmp_path / "kubeconfig"
    empty.touch()

    assert main(["view", "rums", "--kubeconfig", str(empty)]) == 2
    assert capsys.readouterr().out.startswith("rums: is not a folder here")


def test_a_simulator_that_shows_nothing_opens_no_page(run, capsys):
    """An empty page would not explain the cause, so the command prints the sidecar's error."""
    assert main(["view", run]) == 1
    assert capsys.readouterr().out.startswith("collect-0: path: is not one of")
