"""A run directory that another release left is gone on from, by `palaestra run` as a person types it."""

import shutil
from pathlib import Path

import yaml

from palaestra.local import run_directory
from tests.local_run import LocalRun

OLD = Path(__file__).parents[2] / "fixtures" / "a5276f3" / "interrupted"
PATIENCE_S = 240.0  # it takes 20 s on a machine of its own


def test_a_run_of_two_collectors_goes_on_from_a_checkpoint_of_a5276f3(tmp_path):
    """The machine was upgraded between Ctrl-C and the same command again.

    Its unfinished episodes cannot be replayed: a5276f3 drew their starts before it knew what stands where.
    """
    record = yaml.safe_load((OLD / run_directory.RECORD).read_text())
    run = LocalRun(tmp_path, {**record, "metadata": {"name": record["metadata"]["name"]}})
    shutil.copytree(OLD, run.directory)
    # A job's uid on a laptop follows from where its runs lie, and this one lay elsewhere.
    record["metadata"]["uid"] = run_directory.uid_of(run.directory.parent)
    (run.directory / run_directory.RECORD).write_text(yaml.safe_dump(record))

    with run:
        code, output = run.end(PATIENCE_S)

    assert code == 0, output
    assert run.attempts() == ["new run", "resumed at step 200"]
    assert run.log().count("do not repeat") == 1
    assert run.summary()["steps"] == 400
