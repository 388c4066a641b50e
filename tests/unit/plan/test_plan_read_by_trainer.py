"""What the plan writes, the trainer reads: the two packages share no code for it."""

from pathlib import Path

import pytest
import yaml

from palaestra.api import load
from palaestra.plan import ClusterLayout, Images, identified, plan
from palaestra_trainer.configuration import parse

EXAMPLES = sorted((Path(__file__).parents[3] / "manifests" / "examples").glob("*.yaml"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_training_yaml_of_every_example_is_read_by_the_trainer(example):
    """A field that one side renames would be found by a run only, minutes later."""
    job = identified(load(example.read_text()), "uid")
    planned = plan(job, ClusterLayout(images=Images.of_release("1"))).replicas[0]

    read = parse(yaml.safe_load(planned.config_map["data"]["training.yaml"]))

    assert read.steps == job.spec.trainer.steps
    assert [each.name for each in read.simulators] == [
        f"{group.name}-{i}" for group in job.spec.simulators for i in range(group.count)
    ]
    assert read.algorithm.hyperparameters == job.spec.trainer.algorithm.hyperparameters
