"""The script of docs/howto/python.md and the table of docs/reference/commands.md are right."""

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import yaml

from palaestra.cli.commands import COMMANDS
from palaestra.cluster.resources import TRAINING_JOBS
from tests.pages import blocks
from tests.unit.cli.test_cli_cluster import COMMANDS as FOR_CLUSTERS
from tests.waiting import eventually

ROOT = Path(__file__).parents[3]
COMMANDS_PAGE = (ROOT / "docs/reference/commands.md").read_text()
PAGE = (ROOT / "docs/howto/python.md").read_text()


def test_the_script_of_the_page_runs(control_plane, place, tell, tmp_path, monkeypatch, capsys):
    """A reader copies the script and runs it in the namespace of the context.

    The test writes the statuses that an operator would write.
    """
    [script] = blocks(PAGE, "python with-a-cluster")
    kubeconfig = yaml.safe_load(control_plane.kubeconfig.read_text())
    kubeconfig["contexts"][0]["context"]["namespace"] = place.name
    (tmp_path / "kubeconfig").write_text(yaml.safe_dump(kubeconfig))
    monkeypatch.setenv("KUBECONFIG", str(tmp_path / "kubeconfig"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")

    with ThreadPoolExecutor(1) as pool:
        ended = pool.submit(exec, compile(script, "docs/howto/python.md", "exec"), {})
        eventually(lambda: place.get(TRAINING_JOBS, "tiny") or ended.done())
        tell("tiny", "Succeeded", step=2_000, successRate=1.0)
        ended.result(30)

    assert "Succeeded 2000 1.0" in capsys.readouterr().out
    assert place.get(TRAINING_JOBS, "tiny") is None


def test_every_command_of_the_page_exists_and_every_command_is_on_it():
    """A reader must find each command in one of two tables: with a cluster, or without one."""
    for_clusters, others = COMMANDS_PAGE.split("These commands need no cluster:")

    assert commands_in(for_clusters) == {*FOR_CLUSTERS, "view"}
    assert commands_in(for_clusters) | commands_in(others) == set(COMMANDS)


def commands_in(text):
    """Return the commands that have a row in the tables of a text."""
    rows = re.findall(r"^\| (`palaestra .+?`) \|", text, re.MULTILINE)
    return {name for row in rows for name in re.findall(r"`palaestra ([\w-]+)", row)}
