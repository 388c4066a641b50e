"""A planned Job on this machine: its pods run one after another, and end in several ways."""

import json
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palaestra.plan.yaml_text import literal

PLAY = Path(__file__).with_name("play_job.py")
MARKER = "PALAESTRA_LOCAL_CONTAINER"
POLICY = {
    "rules": [
        {"action": "Ignore", "onPodConditions": [{"type": "DisruptionTarget", "status": "True"}]},
        {
            "action": "Ignore",
            "onExitCodes": {"containerName": "trainer", "operator": "In", "values": [75]},
        },
        {
            "action": "FailJob",
            "onExitCodes": {"containerName": "trainer", "operator": "In", "values": [2, 80, 81]},
        },
    ]
}
FORK = "setsid bash -c 'trap \"\" TERM HUP INT; echo $$ >> {pids}; sleep 300' &"

TRAIN = "touch $FOLDER/training; while :; do sleep 0.02; done"


class Play:
    """A Job that a separate process runs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.pids = folder / "pids"
        self.starts = folder / "starts"
        self._runners: list[subprocess.Popen] = []

    def start(
        self, trainer: str, *, sidecar: str = "sleep 300", limit: int = 3, deadline: str = ""
    ) -> subprocess.Popen:
        """Start the runner; every container appends its process id to `pids`."""
        count = f"echo $$ >> {shlex.quote(str(self.pids))}\n"
        trainer = f"echo x >> {shlex.quote(str(self.starts))}\n{count}{trainer}"
        env = [{"name": "FOLDER", "value": str(self.folder)}]
        template = {
            "spec": {
                "terminationGracePeriodSeconds": 10,
                "initContainers": [
                    {
                        "name": "sim-a",
                        "restartPolicy": "Always",
                        "command": ["bash", "-c", literal(count + sidecar)],
                        "env": env,
                    }
                ],
                "containers": [{"name": "trainer", "command": ["bash", "-c", literal(trainer)], "env": env}],
                "volumes": [],
            }
        }
        job = {"spec": {"backoffLimit": limit, "podFailurePolicy": POLICY, "template": template}}
        file = self.folder / "job.json"
        file.write_text(json.dumps(job))
        command = [sys.executable, PLAY, file, self.folder, *deadline.split()]
        self._runners.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        return self._runners[-1]

    def run(self, trainer: str, **options) -> dict:
        """Run a Job to its end, and return the outcome and the number of started trainers."""
        out, _ = self.start(trainer, **options).communicate(timeout=60)
        return json.loads(out.splitlines()[-1]) | {"seen": len(self.starts.read_text().split())}

    def end(self) -> None:
        """Kill the runners that still run; their containers end with them."""
        for runner in self._runners:
            with runner:
                runner.kill()

    def running(self) -> list[int]:
        """Return those processes in `pids` that still run; a zombie does not count."""
        written = self.pids.read_text().split() if self.pids.exists() else []
        return [pid for pid in map(int, written) if _runs(pid)]


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.fixture
def play(tmp_path, eventually):
    """Yield a folder for a Job; after the test, no process of the Job may run."""
    yield (place := Play(tmp_path))
    place.end()
    eventually(lambda: not place.running())


def test_a_trainer_that_is_done_completes_the_job(play):
    """After exit code 0 the run is complete, and a second pod would only repeat it."""
    assert play.run("exit 0") == {"code": 0, "pods": 1, "steps": None, "seen": 1}


@pytest.mark.parametrize("code", [2, 80, 81])
def test_what_a_retry_cannot_mend_is_not_tried_again(play, code):
    """A wrong configuration, a spent budget or a divergence would occur again in every pod."""
    assert play.run(f"exit {code}")["seen"] == 1


def test_other_failures_are_tried_again_up_to_the_limit(play):
    """With `backoffLimit: 1`, one failure is retried, so two pods run."""
    outcome = play.run("exit 82", limit=1)

    assert outcome == {"code": 82, "pods": 2, "steps": None, "seen": 2}


def test_an_interrupted_pod_is_not_counted(play):
    """Exit code 75 means that the run can resume, so a limit of 0 must not end it."""
    outcome = play.run('[ $(wc -l < "$FOLDER/starts") = 2 ] && exit 0; exit 75', limit=0)

    assert outcome["code"] == 0
    assert outcome["seen"] == 2


def test_the_last_word_of_the_trainer_is_part_of_the_outcome(play):
    """The step in the termination message shows how far the run has come."""
    word = json.dumps({"step": 1200, "reason": "Interrupted"})

    outcome = play.run(f"echo {shlex.quote(word)} > $FOLDER/termination.json; exit 2")

    assert outcome["steps"] == 1200


def test_a_killed_runner_leaves_no_process_behind(play, eventually):
    """Even a grandchild in another session that ignores all signals must end."""
    fork = FORK.format(pids=shlex.quote(str(play.pids)))
    runner = play.start(f"trap '' TERM\n{fork}\nsleep 300", sidecar=f"{fork}\nsleep 300")
    eventually(lambda: play.pids.exists() and len(play.pids.read_text().split()) == 4)

    runner.kill()
    runner.communicate()

    eventually(lambda: not play.running())


def test_the_first_ctrl_c_lets_the_trainer_save_and_ends_with_75(play, eventually):
    """The user's Ctrl-C reaches only the runner, which must let the trainer save a checkpoint."""
    runner = play.start(f"trap 'echo saved > $FOLDER/saved; exit 75' TERM; {TRAIN}")
    eventually((play.folder / "training").exists)

    os.kill(runner.pid, signal.SIGINT)
    out, _ = runner.communicate(timeout=20)

    assert json.loads(out.splitlines()[-1])["code"] == 75
    assert (play.folder / "saved").exists()
    assert not play.running()


@pytest.mark.parametrize("code", [1, 80, 81])
def test_ctrl_c_does_not_hide_that_the_trainer_failed(play, eventually, code):
    """Exit code 75 would promise a checkpoint, and a run that diverged must not resume."""
    runner = play.start(f"trap 'exit {code}' TERM; {TRAIN}")
    eventually((play.folder / "training").exists)

    os.kill(runner.pid, signal.SIGINT)
    out, _ = runner.communicate(timeout=20)

    assert json.loads(out.splitlines()[-1]) == {"code": code, "pods": 1, "steps": None}


@pytest.mark.parametrize(
    "trainer",
    [
        pytest.param(f"trap 'exit 75' TERM; {TRAIN}", id="trains"),
        pytest.param("exit 82", id="is waited for between two pods"),
    ],
)
def test_a_run_past_its_deadline_is_stopped_and_has_failed(play, trainer):
    """Kubernetes stops a Job at its deadline too, even during the back-off between two pods."""
    runner = play.start(trainer, limit=100, deadline="1.5")

    out, _ = runner.communicate(timeout=60)

    assert json.loads(out.splitlines()[-1])["code"] == 1
    assert not play.running()


def test_a_run_that_is_done_before_its_deadline_is_not_held_up(play):
    """The runner must not wait for the rest of the time."""
    assert play.run("exit 0", deadline="300")["code"] == 0


def test_the_second_ctrl_c_kills(play, eventually):
    """A user must not have to wait for a checkpoint that hangs."""
    runner = play.start(f"trap 'echo asked > $FOLDER/asked' TERM; {TRAIN}")
    eventually((play.folder / "training").exists)

    os.kill(runner.pid, signal.SIGINT)
    eventually((play.folder / "asked").exists)
    os.kill(runner.pid, signal.SIGINT)
    out, _ = runner.communicate(timeout=20)

    assert json.loads(out.splitlines()[-1])["code"] == 130
    assert not play.running()


def test_a_run_that_was_done_when_it_was_interrupted_stays_done(play, eventually):
    """The trainer completes although it is interrupted, so the run has succeeded."""
    runner = play.start(f"trap 'exit 0' TERM; {TRAIN}")
    eventually((play.folder / "training").exists)

    os.kill(runner.pid, signal.SIGTERM)
    out, _ = runner.communicate(timeout=20)

    assert json.loads(out.splitlines()[-1])["code"] == 0


def test_a_killed_sidecar_takes_its_simulator_with_it_and_comes_back(play, eventually):
    """In a container, all processes end with process 1, and the kubelet restarts the container."""
    fork = FORK.format(pids=shlex.quote(str(play.pids)))
    sidecar = f"echo $$ > $FOLDER/sidecar\n{fork}\nwait"
    runner = play.start("while :; do sleep 0.02; done", sidecar=sidecar)
    eventually(lambda: play.pids.exists() and len(play.pids.read_text().split()) == 3)
    first = play.running()

    os.kill(int((play.folder / "sidecar").read_text()), signal.SIGKILL)
    eventually(lambda: len(play.pids.read_text().split()) == 5)

    still = set(first) & set(play.running())
    os.kill(runner.pid, signal.SIGTERM)
    runner.communicate(timeout=20)
    assert len(still) == 1, "only the trainer may be left of the first three"
    assert not play.running()
