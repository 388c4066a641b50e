"""The guide for coding agents leads from an empty folder to trained jobs, with the commands as they stand."""

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
    """An agent types them one after the other and believes each sentence between them."""
    commands = "".join(blocks(SKILL, "sh"))

    Terminal(tmp_path, path=PALAESTRA.parent).type_in(commands, TYPED_S)

    assert {path.parents[1].name for path in tmp_path.glob("runs/*/0/model.zip")} == {"first", "corridor"}
    assert json.loads((tmp_path / "success.json").read_text())["episodes"] == 5
    assert json.loads((tmp_path / "trainingjob.schema.json").read_text())["title"] == "TrainingJob"
    assert all(
        json.loads(path.read_text())["steps"] == 1000 for path in tmp_path.glob("runs/*/0/summary.json")
    )


def test_explain_prints_the_guide_and_where_it_is(capsys):
    """A program for agents copies the file, or reads it there; `>` must not mix the path into it."""
    assert main(["explain", "--skill"]) == 0

    out, err = capsys.readouterr()
    assert out == SKILL
    assert err == f"{files('palaestra') / 'SKILL.md'}\n"


def test_the_guide_has_the_head_that_agents_look_for():
    """They choose a guide by the name, which is that of its folder, and the description."""
    _, head, _ = SKILL.split("---\n", 2)

    described = yaml.safe_load(head)
    assert described["name"] == files("palaestra").name == "palaestra"
    assert 50 < len(described["description"]) <= 1024
    assert len(SKILL.splitlines()) <= 150
