"""TensorBoard on a claim shows runs by the names of their jobs, even during training."""

import json
import re
import subprocess
import sys
import time
import urllib.parse
import urllib.request
from pathlib import Path

import pytest
from torch.utils.tensorboard.writer import SummaryWriter

from palaestra_trainer.job.configuration import parse
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.tensorboard_link import FOLDER, link_curves
from tests.waiting import eventually

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
RUN = "minimal-0d1f3e5a/0"
TENSORBOARD = Path(sys.executable).with_name("tensorboard")
END_S = 30


@pytest.fixture(params=["true", "false"], ids=["data server", "python"])
def ask(request, tmp_path):
    """Start TensorBoard on an empty claim with one of its two loaders; yield a function for requests."""
    options = ("--host=127.0.0.1", "--port=0", "--reload_interval=1", f"--load_fast={request.param}")
    with subprocess.Popen(
        [TENSORBOARD, f"--logdir={tmp_path / FOLDER}", *options], stderr=subprocess.PIPE, text=True
    ) as server:
        said = (re.search(r" at (http://\S+)/ ", line) for line in server.stderr)
        address = next(found[1] for found in said if found)
        try:
            yield lambda path: json.load(urllib.request.urlopen(f"{address}/data/{path}", timeout=END_S))
        finally:
            server.terminate()
            server.communicate(timeout=END_S)


def steps(ask):
    """Return the steps in the curve of the run, or an empty list if TensorBoard does not have the run yet."""
    if RUN not in ask("runs"):
        return []
    query = urllib.parse.urlencode({"run": RUN, "tag": "loss"})
    return [step for _, step, _ in ask(f"plugin/scalars/scalars?{query}")]


def write(run, step):
    """Write a point into a new file, as another attempt does.

    The function first waits for a second in which no file was created. TensorBoard sorts files by name, and
    names of the same second end in a count of writers, in which 10 sorts before 9.
    """
    eventually(lambda: not list(run.tensorboard.glob(f"*.{int(time.time())}.*")))
    with SummaryWriter(str(run.tensorboard)) as writer:
        writer.add_scalar("loss", 1.0, step)


@pytest.mark.timeout(120)
def test_tensorboard_shows_a_run_by_the_name_of_its_job_and_follows_it(ask, tmp_path):
    """TensorBoard starts before the first point, and the run is restarted once.

    A link to a deleted run must not hide the other runs.
    """
    run = RunDirectory(tmp_path / UID / "0")
    run.path.mkdir(parents=True)
    configuration = {
        "job": "minimal", "uid": UID, "environment": {"id": "Any-v0"}, "steps": 1,
        "simulators": [{"name": "collect-0", "group": "collect", "index": 0, "role": "Collect"}],
    }  # fmt: skip
    link_curves(run, parse(configuration))
    gone = tmp_path / FOLDER / "gone-9b8c7d6e"
    gone.mkdir()
    (gone / "0").symlink_to("../../9b8c7d6e-7c2b-4d68-9a40-c3b2a1908f7e/0/tensorboard")
    assert ask("runs") == []

    write(run, step=1)
    eventually(lambda: steps(ask) == [1])
    write(run, step=2)
    eventually(lambda: steps(ask) == [1, 2])

    assert ask("runs") == [RUN]
