"""`simulators[].reset: Reload`: a simulator loads its world before each episode."""

import pytest

from tests.local_run import LocalRun
from tests.soak import resume
from tests.soak.jobs import LITTLE_DQN, tiny_job


@pytest.mark.parametrize("driver", ["stub", "mujoco"])
def test_a_reload_begins_an_episode_as_a_reset_does(tmp_path, driver):
    """The world file is the initial state, so both runs must learn the same, bit for bit."""
    runs = {}
    for reset in ("Reset", "Reload"):
        where = {"driver": driver, "reset": reset}
        evaluation = {"everySteps": 60, "episodes": 2, "confirmEpisodes": 2}
        job = tiny_job(collect=where, evaluate=where, steps=120, evaluation=evaluation, algorithm=LITTLE_DQN)
        (tmp_path / reset).mkdir()
        runs[reset] = LocalRun(tmp_path / reset, job)
        with runs[reset] as run:
            code, output = run.end()
            assert code == 0, output

    assert [run.summary()["faults"] for run in runs.values()] == [0, 0]
    assert [run.summary()["goodput"]["recycling"] > 0 for run in runs.values()] == [False, True]
    assert resume.results(runs["Reload"].directory) == resume.results(runs["Reset"].directory)
