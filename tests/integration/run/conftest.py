"""`palaestra run` as a person types it: real master, sidecars, stubs and trainer."""

import json
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "manifests/examples"
PALAESTRA = Path(sys.executable).with_name("palaestra")
PATIENCE_S = 120


class Run:
    """One `palaestra run` and its directory."""

    def __init__(self, folder, example="move-to-target", **trainer):
        job = yaml.safe_load((EXAMPLES / f"{example}.yaml").read_text())
        job["spec"]["trainer"].update(trainer)
        self.name = job["metadata"]["name"]
        self.file = folder / "job.yaml"
        self.file.write_text(yaml.safe_dump(job))
        self.runs = folder / "runs"
        self.directory = self.runs / self.name / "0"
        self.process = None

    def start(self, *options):
        """Start it; its output is kept."""
        command = [PALAESTRA, "run", self.file, "--dir", self.runs, *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return self

    def end(self):
        """Wait for its end; return exit code and output."""
        output, _ = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, output

    def status(self):
        """Return what the trainer's /status says, None while nobody answers."""
        try:
            address = self.training()["statusAddress"]
            with urllib.request.urlopen(f"http://{address}/status", timeout=5) as answer:
                return json.load(answer)
        except (OSError, ValueError):
            return None

    def wait_for_step(self, step):
        """Return the status once training is past `step`."""
        give_up = time.monotonic() + PATIENCE_S
        while time.monotonic() < give_up and self.process.poll() is None:
            status = self.status()
            if status and status["step"] >= step:
                return status
            time.sleep(0.05)
        raise AssertionError(f"step {step} was not reached: {self.log()}")

    def training(self):
        """Return the resolved job of the replica."""
        return yaml.safe_load((self.directory / "training.yaml").read_text())

    def summary(self):
        """Return how the run ended."""
        return json.loads((self.directory / "summary.json").read_text())

    def log(self, container="trainer"):
        """Return the log of a container."""
        return (self.directory / "logs" / f"{container}.log").read_text()

    def processes(self):
        """Return pid and command line of everything below the runner."""
        return list(below(self.process.pid))

    def pid_of(self, program, simulator):
        """Return the process of a program that serves one simulator."""
        return next(
            pid
            for pid, command in self.processes()
            if program in command and f"{simulator}.wbt" in command and "keeper" not in command
        )


@pytest.fixture
def run(tmp_path):
    """Makes runs in a folder of their own; whatever is left of them is ended with the test."""
    made = []

    def make(example="move-to-target", **trainer):
        made.append(Run(tmp_path, example, **trainer))
        return made[-1]

    yield make
    for each in made:
        if each.process and each.process.poll() is None:
            each.process.send_signal(signal.SIGINT)
            each.process.communicate(timeout=PATIENCE_S)


def below(ancestor):
    """Yield pid and command line of every process below `ancestor`."""
    table = {}
    for directory in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((directory / "stat").read_text().rpartition(")")[2].split()[1])
            command = (directory / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        table[int(directory.name)] = (parent, command)
    wanted = {ancestor}
    while wanted:
        wanted = {pid for pid, (parent, _) in table.items() if parent in wanted}
        yield from ((pid, table[pid][1]) for pid in wanted)
