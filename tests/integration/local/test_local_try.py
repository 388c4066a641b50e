"""`palaestra try --local` runs a task with a real simulator."""

import json
import os
import pty
import signal
import subprocess
import termios

import pytest

from tests.local_run import EXAMPLES, PALAESTRA, below, left_of
from tests.waiting import eventually

PATIENCE_S = 120
TINY = EXAMPLES / "tiny.yaml"


def started(folder, *options, stdin=subprocess.DEVNULL):
    """Start `palaestra try`, with its temporary files in a folder, and return the process."""
    return subprocess.Popen(
        [PALAESTRA, "try", "--local", TINY, *options],
        env={**os.environ, "TMPDIR": str(folder)},
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_task_that_ships_is_tried_without_a_problem(tmp_path):
    """The task must pass all checks, and the command must report the time of every part of a step."""
    process = started(tmp_path, "--episodes", "2", "--json")
    out, err = process.communicate(timeout=PATIENCE_S)

    found = json.loads(out)
    assert process.returncode == 0, err
    assert found["problems"] == []
    assert len(found["episodes"]) == 2
    assert min(found["step_ms"].values()) > 0
    assert not list(tmp_path.glob("palaestra-try-*"))


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_a_try_that_is_ended_leaves_no_process_and_no_file(tmp_path, number, code):
    """People often end a try early. After SIGKILL, the program itself cannot clean up."""
    process = started(tmp_path, "--episodes", "9999")
    with process:
        for line in process.stdout:
            if line.startswith("episode"):
                break
        pids = [pid for pid, _ in below(process.pid)]
        process.send_signal(number)
        process.communicate(timeout=PATIENCE_S)

    assert process.returncode == code
    assert len(pids) >= 4
    assert left_of(pids) == []
    assert eventually(lambda: not list(tmp_path.glob("palaestra-try-*")), PATIENCE_S)


def test_a_person_drives_with_the_keys_of_a_terminal(tmp_path):
    """Each key makes one step, even an arrow key of three bytes, and the terminal's mode is restored."""
    controller, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    process = started(tmp_path, "--agent", "keyboard", stdin=terminal)
    with process:
        for line in process.stdout:
            if line.startswith("keys: up: forward"):
                break
        os.write(controller, b"\x1b[A q")
        out, err = process.communicate(timeout=PATIENCE_S)

    assert process.returncode == 0, err
    assert [line.partition(":")[0] for line in out.splitlines()][:2] == ["step 1", "step 2"]
    assert termios.tcgetattr(terminal) == before
    os.close(controller)
    os.close(terminal)
