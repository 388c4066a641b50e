"""The operator's cache holds little of a large job, and a plan is made from the API server's data."""

import re
from pathlib import Path

from palaestra.cluster.resources import CONFIG_MAPS, TRAINING_JOBS
from palaestra_sim.world import builtin
from tests.jobs import make_job
from tests.waiting import eventually

LARGE, MOST_MIB = 40, 100
NO_EVALUATION = {"evaluation": {"everySteps": 0}}


def with_worlds(*texts):
    """Return the fields of a job with one group of simulators for each inline world."""
    groups = [
        {"name": f"g{place}", "role": "Collect", "world": {"inline": text}}
        for place, text in enumerate(texts)
    ]
    return {"simulators": groups, "trainer": NO_EVALUATION}


def test_a_job_is_planned_from_its_worlds_and_not_from_their_digests(place, start):
    """The cache holds only digests of the worlds, but the pods must get the author's text."""
    world = builtin("arena").decode() + "# " + "x" * 1000 + "\n"
    start()

    place.train(**with_worlds(world))

    place.pods()
    [made] = place.all(CONFIG_MAPS, "job")
    assert made["data"]["g0.wbt"].endswith("x" * 1000 + "\n")


def test_a_large_job_is_refused_by_what_it_holds_and_not_by_what_is_kept_of_it(place, start):
    """Only the operator checks these fields, so it must read the large fields that its cache drops."""
    start()

    place.train(trainer={"algorithm": {"hyperparameters": {"x": [0] * 30_000}}})

    status = place.until("Failed")
    assert "contains more than 1000 values" in status["conditions"][0]["message"]


def all_have_failed(place):
    """Return whether every TrainingJob in the namespace has failed.

    The request is for a table, because the jobs contain large worlds.
    """
    rows = place.api.table(TRAINING_JOBS, place.name)["rows"]
    return [row["cells"][1] for row in rows] == ["Failed"] * LARGE


def test_large_jobs_that_are_refused_leave_the_operator_small(place, start):
    """The operator starts after the jobs exist. It reads all of them at once, which needs the most memory."""
    worlds = with_worlds(*(["x" * 180_000] * 5))
    for number in range(LARGE):
        place.create(TRAINING_JOBS, make_job(f"job-{number}", **worlds))
    operator = start()

    eventually(lambda: all_have_failed(place), 90)

    told = Path(f"/proc/{operator.process.pid}/status").read_text()
    assert int(re.search(r"VmHWM:\s+(\d+) kB", told)[1]) / 1024 < MOST_MIB
