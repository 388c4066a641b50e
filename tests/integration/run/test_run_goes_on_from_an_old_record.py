"""`palaestra run` resumes a run directory that another release wrote."""

import shutil
from pathlib import Path

import yaml

from palaestra.local import run_directory
from palaestra.local.outcome import RunOutcome
from tests.local_run import LocalRun

OLD = Path(__file__).parents[2] / "fixtures" / "0.1.0" / "interrupted"
PATIENCE_S = 240.0  # the run takes 20 s on an idle machine


def test_a_run_of_two_collectors_goes_on_from_a_checkpoint_of_0_1_0(tmp_path):
    """A user may upgrade the packages between Ctrl-C and the same command."""
    record = yaml.safe_load((OLD / run_directory.RECORD).read_text())
    saved = RunOutcome.of(OLD).saved
    run = LocalRun(tmp_path, {**record, "metadata": {"name": record["metadata"]["name"]}})
    shutil.copytree(OLD, run.directory)
    # On a laptop, the uid of a job depends on its folder, and the recorded run was in another folder.
    record["metadata"]["uid"] = run_directory.uid_of(run.directory.parent)
    (run.directory / run_directory.RECORD).write_text(yaml.safe_dump(record))

    with run:
        code, output = run.end(PATIENCE_S)

    assert code == 0, output
    assert run.attempts() == ["new run", f"resumed at step {saved}"]
    assert "do not repeat" not in run.log()
    assert run.summary()["steps"] == 400
