"""`palaestra run` with the real ROS master and sidecars; small programs stand in for the trainer."""

import fcntl
import os
import pty
import re
import signal
import socket
import subprocess
import zipfile
from pathlib import Path

import pytest
import yaml

from palaestra_protocol.policy_package import MANIFEST, manifest_text
from tests.integration.local.desk import PATIENCE_S, Desk
from tests.local_run import left_of
from tests.strangers import DRIVE, rover

ASK = """\
import os, pathlib, xmlrpc.client, yaml
run = pathlib.Path(os.environ["PALAESTRA_RUN"])
xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]).getPid("/test")
config = yaml.safe_load(pathlib.Path(os.environ["PALAESTRA_CONFIG"]).read_text())
for simulator in config["simulators"]:
    assert pathlib.Path(simulator["world"]).is_file(), simulator
(run / "summary.json").write_text('{"steps": 7, "success_rate": 0.5, "faults": 2}')
"""
TELL = """\
import os, pathlib, yaml
config = yaml.safe_load(pathlib.Path(os.environ["PALAESTRA_CONFIG"]).read_text())
print("trains to", config["steps"], "from", config["initialPolicy"])
"""
WAIT = """\
import os, pathlib, signal, sys
run = pathlib.Path(os.environ["PALAESTRA_RUN"])
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])  # keeps a SIGTERM that comes before the wait
(run / "begun").touch()
print("waiting", file=sys.stderr)
while True:
    signal.sigwait([signal.SIGTERM])
    sys.exit(75)
"""
REFUSE = """\
import os, pathlib, sys
word = '{"step": 0, "reason": "ConfigurationWrong: gama: is not known; did you mean gamma?"}'
pathlib.Path(os.environ["PALAESTRA_TERMINATION_LOG"]).write_text(word)
sys.exit(2)
"""
START = """\
import os, pathlib, yaml
from palaestra_trainer.webots.launching.sidecar import Sidecar
config = yaml.safe_load(pathlib.Path(os.environ["PALAESTRA_CONFIG"]).read_text())
for simulator in config["simulators"]:
    sidecar = Sidecar(simulator["control"], simulator["name"])
    sidecar.first_state(deadline_s=60)
    sidecar.start()
"""
TRAIN = START + WAIT


@pytest.fixture
def desk(tmp_path):
    """Yield a folder in which a test runs a user's commands."""
    desk = Desk(tmp_path)
    yield desk
    desk.clear()


def test_a_run_ends_with_a_summary_and_is_reported_when_it_is_typed_again(desk):
    """The same command must report a finished run and not train again."""
    desk.write(ASK)

    code, out = desk.run()
    again, report = desk.run()

    assert (code, again) == (0, 0), out
    for line in ("success rate      50%", "steps             7", "faults            2"):
        assert line in out
        assert line in report
    assert "has already finished" in report


def test_a_finished_run_is_prolonged_by_more_steps_and_began_with_the_policy_of_another(desk):
    """More steps do not change the initial policy of a run, so the trainer gets that policy's path again.

    A user types the path of the other run, or of a package, relative to the working directory.
    """
    other = desk.folder / "other"
    other.mkdir()
    with zipfile.ZipFile(other / "model.zip", "w") as archive:
        archive.writestr("policy.pth", b"")
    command = {"command": ["python", str(desk.folder / "program.py")]}
    desk.write(TELL, trainer=command | {"steps": 40})
    first = desk.run("--initial-policy", "other")
    desk.write(TELL, trainer=command | {"steps": 80})
    (other / MANIFEST).write_bytes(manifest_text({}, {"model.zip": (other / "model.zip").read_bytes()}))

    second = desk.run("--initial-policy", "other")
    nothing = desk.run("--initial-policy", "nothing")

    assert first[0] == second[0] == 0
    assert f"trains to 40 from {other}/model.zip" in first[1]
    assert f"trains to 80 from {other}/model.zip" in second[1]
    assert nothing[0] == 2
    assert "spec.trainer.initialPolicy.path" in nothing[1]


def test_a_run_whose_output_is_no_longer_read_ends_as_it_would_have(desk):
    """`palaestra run job.yaml | head` closes the pipe after ten lines, and training must continue."""
    desk.write(ASK)

    process = desk.start()
    process.stdout.close()

    assert process.wait(PATIENCE_S) == 0
    assert (desk.run_directory / "summary.json").exists()


def test_a_run_whose_output_is_on_a_full_disk_ends_as_it_would_have(desk):
    """The disk of the output may be full in the night; the run directory may be on another disk."""
    desk.write(ASK)

    with Path("/dev/full").open("w") as full:
        process = desk.start(stdout=full, stderr=subprocess.PIPE)

    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert errors == "standard output: No space left on device; the run goes on without its lines\n"
    assert (desk.run_directory / "summary.json").exists()


def test_the_run_directory_holds_what_was_run(desk):
    """A user finds all inputs and logs of the run in one folder."""
    desk.write(ASK)

    desk.run()

    names = {str(each.relative_to(desk.run_directory)) for each in desk.run_directory.rglob("*.*")}
    assert {"worlds/collect.wbt", "worlds/evaluate.wbt", "training.yaml", "job.yaml"} <= names
    assert {"logs/ros-master.log", "logs/sim-collect-0.log", "logs/trainer.log"} <= names


def test_fresh_begins_anew_and_keeps_the_old_run(desk):
    """A user can compare the new run with the old one, which keeps its files."""
    desk.write(ASK)
    desk.run()

    code, out = desk.run("--fresh")

    assert code == 0
    assert "already finished" not in out
    assert (desk.run_directory.parent / "0.old-1" / "summary.json").exists()


def test_a_wrong_job_is_corrected_without_fresh(desk):
    """No step was trained, so the refused run and its logs are only moved aside."""
    desk.write(REFUSE)
    refused, _ = desk.run()
    desk.write(ASK, seed=7)

    code, out = desk.run()

    assert (refused, code) == (2, 0), out
    aside = desk.run_directory.parent / "0.old-1"
    assert f"{desk.run_directory}: the earlier run was moved to {aside}" in out
    assert (aside / "logs" / "trainer.log").exists()


def test_a_second_run_of_the_same_directory_is_refused(desk, eventually):
    """Two runs in one directory would overwrite each other's checkpoints."""
    desk.write(WAIT)
    first = desk.start()
    eventually((desk.run_directory / "begun").exists)

    code, out = desk.run()
    first.send_signal(signal.SIGINT)
    _, _ = first.communicate(timeout=PATIENCE_S)

    assert code == 2
    assert "is in use by `palaestra run` (process" in out
    assert first.returncode == 75


def test_ctrl_c_ends_with_75_says_how_to_go_on_and_leaves_no_process(desk, eventually):
    """The user can resume with the same command, and no process stays on the machine."""
    process, pids = desk.training(eventually, TRAIN)

    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 75
    assert "interrupted; the same command starts the job's program again" in out
    assert not _processes_that_name(desk.folder)
    assert left_of(pids) == []


def test_a_second_ctrl_c_does_not_wait_for_the_trainer_and_leaves_no_process(desk, eventually):
    """The user does not wait for a checkpoint any more, but no simulator may stay."""
    process, pids = desk.training(eventually, TRAIN.replace("sys.exit(75)", "(run / 'asked').touch()"))
    process.send_signal(signal.SIGINT)
    eventually((desk.run_directory / "asked").exists)

    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 130
    assert "killed; the same command starts the job's program again" in out
    assert not _processes_that_name(desk.folder)
    assert left_of(pids) == []


def test_ctrl_c_tells_a_trainer_that_fails_on_it_and_starts_no_further_replica(desk, eventually):
    """The user must learn that no checkpoint was saved, and that the command has ended."""
    desk.write(WAIT.replace("sys.exit(75)", "sys.exit('no room to save')"), replicas=2)
    process = desk.start()
    eventually((desk.run_directory / "begun").exists)

    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 1
    assert "interrupted, and failed: the trainer ended with exit code 1" in out
    assert "no room to save" in out
    assert not desk.run_directory.with_name("1").exists()


def test_a_run_past_its_deadline_says_so_and_can_go_on(desk):
    """The user may increase the deadline and continue, because the run is intact."""
    desk.write(WAIT, activeDeadlineSeconds=1)

    code, out = desk.run()
    desk.write(ASK, activeDeadlineSeconds=300)
    again, _ = desk.run()

    assert (code, again) == (1, 0)
    assert "failed: DeadlineExceeded: spec.activeDeadlineSeconds has passed" in out


def test_a_killed_run_leaves_neither_process_nor_lock(desk, eventually):
    """After SIGKILL of the runner, no process stays, and the user can resume the run."""
    process, pids = desk.training(eventually, TRAIN)

    process.kill()
    process.communicate()

    assert left_of(pids) == []
    eventually(lambda: not _processes_that_name(desk.folder))
    with (desk.run_directory.parent / "0.lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _processes_that_name(folder: Path) -> list[str]:
    """Return the ids of processes whose environment names a run below the folder."""
    found = []
    for entry in os.scandir("/proc"):
        try:
            environment = Path(f"/proc/{entry.name}/environ").read_bytes()
        except OSError:
            continue
        if f"PALAESTRA_RUN={folder}".encode() in environment:
            found.append(entry.name)
    return found


def test_verbose_shows_every_log_with_the_name_of_its_container(desk):
    """Without `-v`, the screen shows only the trainer's output."""
    desk.write("print('hello from the trainer')")

    _, out = desk.run("-v")

    assert "[trainer] hello from the trainer" in out


def test_a_failure_prints_its_last_lines_and_the_path_of_its_log(desk):
    """A user must see the cause of a failure without a search for the log."""
    desk.write("raise SystemExit('no such reward')")

    code, out = desk.run()

    assert code == 1
    assert "failed: the trainer ended with exit code 1" in out
    assert "no such reward" in out
    assert "logs/trainer.log" in out


def test_a_changed_job_is_refused_and_nothing_is_touched(desk):
    """The checkpoints belong to a training with the recorded job."""
    desk.write("raise SystemExit(1)", seed=1)
    desk.run()
    before = (desk.run_directory / "job.yaml").read_text()

    desk.write("raise SystemExit(1)", seed=2)
    code, out = desk.run()

    assert code == 2
    assert "spec.seed: was 1, is 2" in out
    assert (desk.run_directory / "job.yaml").read_text() == before


def test_a_port_in_use_is_one_line_and_nothing_is_written(desk):
    """The user has chosen the port, so only the user can choose another one."""
    desk.write(ASK)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]

        code, out = desk.run("--ros-port", str(port))

    assert code == 2
    assert out.startswith(f"port {port}: ")
    assert len(out.splitlines()) == 1
    assert not desk.run_directory.exists()


def test_replicas_run_one_after_another(desk):
    """Each replica trains with a different seed, in its own directory."""
    desk.write(ASK, replicas=2)

    code, out = desk.run()

    assert code == 0
    seeds = [
        yaml.safe_load((desk.run_directory.parent / name / "training.yaml").read_text())["seed"]
        for name in ("0", "1")
    ]
    assert seeds == [1, 2]
    assert out.index("desk-0") < out.index("desk-1")


def test_on_a_terminal_the_trainer_draws_and_the_log_stays_readable(desk):
    """A progress bar that was drawn repeatedly must be one line of the log."""
    bar = (
        "import sys; assert sys.stderr.isatty(); "
        "sys.stderr.write('\\r10%\\r\\x1b[2K20%\\x1b[0m\\n'); sys.stderr.flush()"
    )
    desk.write(bar)
    ours, theirs = pty.openpty()

    process = desk.start(stdout=theirs, stderr=theirs)
    os.close(theirs)
    drawn = _read_to_the_end(ours)
    process.wait(timeout=PATIENCE_S)

    assert process.returncode == 0
    assert b"\r10%\r\x1b[2K20%" in drawn
    assert "20%" in (desk.run_directory / "logs" / "trainer.log").read_text().splitlines()


def _read_to_the_end(terminal: int) -> bytes:
    """Return the output on a terminal until no process writes to it any more."""
    drawn = b""
    while True:
        try:
            drawn += os.read(terminal, 4096)
        except OSError:  # EIO: the other end is closed
            os.close(terminal)
            return drawn


def test_a_differential_robot_drives_by_its_own_program(desk):
    """Another project's world has other names of wheels, and neither a ROS name nor `--synchronize`."""
    desk.write(
        DRIVE,
        simulators=[rover()],
        trainer={"command": ["python", str(desk.folder / "program.py")], "evaluation": {"everySteps": 0}},
    )

    code, out = desk.run()

    assert code == 0, out
    x, degrees = re.search(r"stopped at (\S+) -?0.00 .* turned by (\S+) degrees", out).groups()
    assert 0.40 < float(x) < 0.52
    assert 100 < float(degrees) < 125
