"""The two jobs of `palaestra demo`: one trains a policy, the other plays it."""

from pathlib import Path

import palaestra.api
from palaestra.cli.demo import demo_job, playing_job

EXAMPLE = Path(__file__).parents[3] / "manifests/examples/move-to-target.yaml"


def test_the_demo_trains_the_example_of_make_run():
    """The README gives the results of this example.

    A wheel contains a copy for the demo, which must be equal to the example.
    """
    example = palaestra.api.load(EXAMPLE.read_text(), EXAMPLE.name)

    assert demo_job().spec == example.spec
    assert demo_job().metadata.name == "demo"


def test_the_policy_plays_in_the_world_in_which_it_learned():
    """A viewer should see the policy reach the target, and the policy has learned this in only one world."""
    learns = demo_job()

    plays = playing_job(learns, Path("/runs/demo/0"))

    [simulator] = plays.spec.simulators
    assert simulator.world == learns.spec.simulators[0].world
    assert plays.spec.trainer.environment == learns.spec.trainer.environment
    assert plays.spec.trainer.command[-1] == "/runs/demo/0"
