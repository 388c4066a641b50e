"""The metrics of a real run's trainer and sidecar agree with docs/reference/metrics.md.

The operator's tests compare the metrics of the operator.
"""

import re
import urllib.request

import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.local_run import LocalRun
from tests.metrics import complaints, documented, served
from tests.soak.jobs import LITTLE_DQN, tiny_job

HEALTH = re.compile(r"health=(\S+)")


def scrape(address):
    """Return the text of /metrics at an address."""
    with urllib.request.urlopen(f"http://{address}/metrics", timeout=10) as answer:
        return answer.read().decode()


@pytest.fixture(scope="module")
def texts(tmp_path_factory):
    """Return the metrics of a run's trainer and sidecar after an evaluation and a checkpoint."""
    job = tiny_job(
        environment={"id": "MoveToTargetEnv-v0", "options": {"max_steps": 20}},
        algorithm=LITTLE_DQN,
        steps=50_000,
        evaluation={"everySteps": 300, "episodes": 2, "confirmEpisodes": 2},
        checkpoint={"everySteps": 200, "keep": 2},
    )
    with LocalRun(tmp_path_factory.mktemp("run"), job) as run:
        run.wait_for_step(800)  # DQN learns from step 40 and logs every ten episodes
        return {
            "trainer": scrape(run.training()["statusAddress"]),
            "sidecar": scrape(HEALTH.search(run.log("sim-collect-0"))[1]),
        }


def test_a_run_serves_the_page(texts):
    """A user relies on the page: each of its metrics must exist with its type and have a value."""
    assert served(texts["trainer"]) == documented("trainer")
    assert served(texts["sidecar"]) == documented("sidecar")
    silent = {
        family.name
        for text in texts.values()
        for family in text_string_to_metric_families(text)
        if not family.samples
    }
    assert silent == set()


@pytest.mark.parametrize("program", ["trainer", "sidecar"])
def test_promtool_has_nothing_to_say_of_it(texts, program):
    """Other tools rely on Prometheus' conventions about names, types and texts."""
    assert complaints(texts[program]) == ""


def test_a_run_tells_numbers_that_fit_together(texts):
    """The numbers come from several modules of the trainer and from the sidecar, and must be consistent."""
    values = {
        (sample.name, *sorted(sample.labels.values())): sample.value
        for text in texts.values()
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }
    steps = values["palaestra_trainer_steps_total",]
    taken = values["palaestra_simulator_step_duration_seconds_count", "collect-0"]
    simulated_s = values["palaestra_simulator_simulated_seconds_total", "collect-0"]

    assert steps <= taken < 2 * steps  # `taken` is read later, and the simulator steps in the meantime
    assert simulated_s >= 0.192 * steps  # resets take steps too
    episodes = values["palaestra_trainer_episodes_total",]
    assert 0 <= values["palaestra_trainer_episode_return_bucket", "+Inf"] - episodes <= 3
    assert values["palaestra_trainer_evaluations_total",] >= 2
    assert steps - values["palaestra_trainer_checkpoint_steps",] < 400
    assert values["palaestra_trainer_exploration", "exploration_rate"] <= 1
    assert values["palaestra_trainer_loss", "loss"] > 0
    assert values["palaestra_simulator_up", "a"] == values["palaestra_simulator_state", "a", "ready"] == 1
    assert values["palaestra_simulator_cpu_seconds_total", "a"] > 0
