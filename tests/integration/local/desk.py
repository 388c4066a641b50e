"""A folder in which a test runs `palaestra run` as a user does."""

import subprocess
import sys
from pathlib import Path

import yaml

from tests.jobs import make_job
from tests.local_run import below

PALAESTRA = Path(sys.executable).with_name("palaestra")
PATIENCE_S = 60


class Desk:
    """A folder with a job file and the commands that a test runs there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.job = folder / "job.yaml"
        self.run_directory = folder / "runs" / "desk" / "0"
        self._started: list[subprocess.Popen] = []

    def write(self, program: str, **spec) -> None:
        """Write a job whose trainer is a Python program."""
        file = self.folder / "program.py"
        file.write_text(program)
        job = make_job("desk", **{"backoffLimit": 0, "trainer": {"command": ["python", str(file)]}, **spec})
        self.job.write_text(yaml.safe_dump(job))

    def start(self, *options: str, **how) -> subprocess.Popen:
        """Start `palaestra run`."""
        how = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, **how}
        self._started.append(subprocess.Popen([PALAESTRA, "run", self.job, *options], cwd=self.folder, **how))
        return self._started[-1]

    def clear(self) -> None:
        """Kill the runs that a failed test left, with all their processes."""
        for process in (each for each in self._started if each.poll() is None):
            process.kill()
            process.communicate()

    def training(self, eventually, program: str) -> tuple[subprocess.Popen, list[int]]:
        """Start a run whose trainer starts its simulators, and wait until they run.

        Returns:
            The process of the command, and the ids of all its child processes.
        """
        self.write(program)
        process = self.start()
        eventually((self.run_directory / "begun").exists)
        eventually(lambda: sum("palaestra-stub" in " ".join(words) for _, words in below(process.pid)) >= 2)
        return process, [pid for pid, _ in below(process.pid)]

    def run(self, *options: str) -> tuple[int, str]:
        """Run `palaestra run` to its end, and return exit code and output."""
        process = self.start(*options)
        out, _ = process.communicate(timeout=PATIENCE_S)
        return process.returncode, out
