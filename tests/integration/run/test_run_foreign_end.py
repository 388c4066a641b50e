"""If a job author's code ends the trainer's process, the run is not complete."""

from tests.local_run import LocalRun
from tests.soak.jobs import LITTLE_PPO, tiny_job

LEAVES = """
import os, gymnasium
from palaestra_trainer.environments import MoveToTargetEnv

class Leaves(MoveToTargetEnv):
    taken = 0

    def step(self, action):
        self.taken += 1
        return super().step(action) if self.taken < 40 else os._exit(0)

gymnasium.register("Leaves-v0", Leaves)
"""


def test_a_library_that_ends_the_process_does_not_complete_the_run(tmp_path, monkeypatch):
    """Exit code 0 looks like a success, but the run has no model."""
    (tmp_path / "leaves.py").write_text(LEAVES)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    environment = {"id": "leaves:Leaves-v0"}
    job = tiny_job(environment=environment, algorithm=LITTLE_PPO, steps=100, evaluation={"everySteps": 0})
    job["spec"]["backoffLimit"] = 0

    with LocalRun(tmp_path, job) as run:
        code, output = run.end()

    assert code == 1, output
    assert "ProgramEnded: the trainer ended with exit code 0, and did not report" in output
