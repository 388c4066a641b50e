"""With a real run and a real operator, the queries of every panel and alert return data."""

import math
from contextlib import suppress

from tests.integration.monitoring.life import address, diverge
from tests.local_run import LocalRun
from tests.monitoring import targets
from tests.monitoring.prometheus import NotAnswered, scraping
from tests.monitoring.questions import looked_at, questions
from tests.soak.jobs import LITTLE_DQN, tiny_job

OVER, SHOWN = "30s", "10m"  # the range of rates, and the time range of a dashboard
ANSWERED_S = 150
# Faults are needed, because panels about faults would have no data otherwise.
FAULTY = {
    "faults": "crash:step=60 lost:topic=ir1/value,every=25",
    "algorithm": LITTLE_DQN,
    "steps": 100_000,
    "evaluation": {"everySteps": 100, "episodes": 1, "confirmEpisodes": 1},
    "checkpoint": {"everySteps": 50, "keep": 2},
}


def test_every_query_of_every_panel_and_all_that_an_alert_looks_at_is_answered(tmp_path, place, start):
    """A user takes an empty panel, or an alert without data, as a sign that all is well."""
    operator = start(elect=True)
    folder = tmp_path / "prometheus"
    folder.mkdir()
    asked = [*questions(OVER, SHOWN), *looked_at()]

    with LocalRun(tmp_path, tiny_job(**FAULTY)) as run:
        scraped = [*targets.of_run(run, place.name), targets.of_operator(address(operator))]
        with scraping(scraped, folder) as prometheus, suppress(NotAnswered):  # the assertion names the query
            prometheus.until(lambda: prometheus.query("palaestra_operator_leader == 1"), ANSWERED_S)
            diverge(place)
            place.train("waiting")
            place.hold_up(place.pods("waiting")[0], "ImagePullBackOff", "no such image")
            prometheus.until(lambda: not _drop_answered(asked, prometheus), ANSWERED_S)

    assert not asked, "\n".join(f"{it.dashboard}: {it.panel} {it.expr}" for it in asked)


def _drop_answered(asked, prometheus):
    """Remove the queries that return a number by now, and return the rest."""
    asked[:] = [it for it in asked if not any(map(_is_number, prometheus.query(it.expr)))]
    return asked


def _is_number(series):
    return math.isfinite(float(series["value"][1]))
