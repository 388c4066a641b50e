"""The code in docs/howto/callbacks.md is executed without changes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from palaestra.api import load
from palaestra.plan import ClusterLayout, Images, identified, plan
from palaestra_trainer.job.configuration import parse
from tests.pages import blocks

PAGE = (Path(__file__).parents[4] / "docs/howto/callbacks.md").read_text()


@pytest.fixture
def job_of_the_page():
    """Return the algorithm in the page's job as the trainer reads it."""

    def read(kind):
        job = identified(load(blocks(PAGE, f"yaml {kind}")[0]), "uid")
        planned = plan(job, ClusterLayout(images=Images.of_release("1"))).replicas[0]
        return parse(yaml.safe_load(planned.config_map["data"]["training.yaml"])).algorithm

    return read


def test_the_callback_of_the_page_ends_training(play, job, directory, job_of_the_page, tmp_path, monkeypatch):
    """In the corridor the return cannot rise for ever, so the callback must end the training."""
    (tmp_path / "bored.py").write_text(blocks(PAGE, "python bored")[0])
    monkeypatch.syspath_prepend(str(tmp_path))
    short = job("PPO", steps=5000, evaluation={"everySteps": 0})
    callbacks = job_of_the_page("bored").callbacks
    algorithm = short.algorithm.model_copy(update={"callbacks": callbacks})

    code, _ = play(short.model_copy(update={"algorithm": algorithm}))

    assert code == 0
    assert json.loads(directory.summary.read_text())["steps"] < 5000
