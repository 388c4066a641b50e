"""The commands of the guide for coding agents train jobs in an empty folder, without any other command."""

import json
from importlib.resources import files

import yaml

from palaestra.cli import main
from tests.local_run import PALAESTRA
from tests.pages import blocks
from tests.terminal import Terminal

TYPED_S = 280
SKILL = (files("palaestra") / "SKILL.md").read_text(encoding="utf-8")


def test_the_commands_of_the_guide_train_two_jobs_from_an_empty_folder(tmp_path):
    """An agent runs the commands in order and relies on the sentences between them."""
    commands = "".join(blocks(SKILL, "sh"))

    Terminal(tmp_path, path=PALAESTRA.parent).type_in(commands, TYPED_S)

    assert {path.parents[1].name for path in tmp_path.glob("runs/*/0/model.zip")} == {"first", "corridor"}
    assert json.loads((tmp_path / "success.json").read_text())["episodes"] == 5
    assert json.loads((tmp_path / "trainingjob.schema.json").read_text())["title"] == "TrainingJob"
    assert all(
        json.loads(path.read_text())["steps"] == 1000 for path in tmp_path.glob("runs/*/0/summary.json")
    )


def test_explain_prints_the_guide_and_where_it_is(capsys):
    """The text goes to standard output and the path to standard error, so that `>` copies the text only."""
    assert main(["explain", "--skill"]) == 0

    out, err = capsys.readouterr()
    assert out == SKILL
    assert err == f"{files('palaestra') / 'SKILL.md'}\n"


def test_the_guide_has_the_head_that_agents_look_for():
    """An agent chooses a guide by its description and by its name, which must equal the folder's."""
    _, head, _ = SKILL.split("---\n", 2)

    described = yaml.safe_load(head)
    assert described["name"] == files("palaestra").name == "palaestra"
    assert 50 < len(described["description"]) <= 1024
    assert len(SKILL.splitlines()) <= 150
