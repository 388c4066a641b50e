"""A simulator that a script starts may print without limit, and ends with the script."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from palaestra_trainer.errors import ConfigurationError, SimulatorDead, SimulatorHung
from palaestra_trainer.webots import Webots
from palaestra_trainer.webots.launching.subprocesses import drain, end_child, first_line, start_child
from tests.local_run import below
from tests.waiting import eventually

PATIENCE_S = 60.0
CHATTERBOX = """
import sys
print("hello", flush=True)
for _ in range(20000):
    print("x" * 99)
print("done", file=sys.stderr, flush=True)
sys.stdin.read()
"""

OWNER = """
import sys
from palaestra_trainer.webots import Webots
webots = Webots("robotino", "arena")
webots.start()
print(webots._launcher.state().pid, flush=True)
sys.stdin.read()
"""


def test_a_child_that_prints_without_end_is_not_stopped_by_a_full_pipe(tmp_path):
    """Webots forwards the output of its controllers, and no script reads this output."""
    mark = tmp_path / "done"
    program = CHATTERBOX.replace('print("done", file=sys.stderr, flush=True)', f"open({str(mark)!r}, 'w')")
    child = start_child([sys.executable, "-c", program], stderr=subprocess.PIPE)
    assert first_line(child) == "hello\n"

    drain(child)

    give_up = time.monotonic() + 20
    while not mark.exists() and time.monotonic() < give_up:
        time.sleep(0.02)
    end_child(child)
    assert mark.exists()


def test_a_killed_script_leaves_no_simulator(master):
    """The kernel closes the sidecar's standard input when the script ends in any way."""
    del master
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    simulator = Path(f"/proc/{int(owner.stdout.readline())}")
    assert simulator.exists()

    owner.kill()
    owner.communicate()

    give_up = time.monotonic() + 10
    while simulator.exists() and time.monotonic() < give_up:
        time.sleep(0.02)
    assert not simulator.exists()


@pytest.mark.parametrize("killed", ["script", "sidecar"])
def test_nothing_killed_leaves_the_folder_of_a_world_with_other_names(master, tmp_path, killed):
    """A second simulator of a world runs a copy of the world file, and such copies would fill the disk."""
    del master
    code = (
        "import sys\n"
        "from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher\n"
        "launcher = ProcessLauncher('arena', suffix='_2')\n"
        "print(launcher.state().world, flush=True)\n"
        "sys.stdin.read()\n"
    )
    owner = subprocess.Popen(
        [sys.executable, "-c", code],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    world = Path(owner.stdout.readline().strip())
    assert tmp_path in world.parents
    assert world.exists()

    sidecar = next(
        pid for pid, words in below(owner.pid) if any("palaestra-sidecar" in word for word in words)
    )
    os.kill(owner.pid if killed == "script" else sidecar, signal.SIGKILL)

    assert eventually(lambda: list(tmp_path.glob("palaestra-world-*")) == [], PATIENCE_S)
    owner.kill()
    owner.communicate()


def test_the_error_inside_a_context_is_raised_and_not_that_the_simulator_is_gone(own_arena):
    """The `with` block cannot pause a stopped simulator, but the user must see the original error."""

    def fail():
        with own_arena.webots:
            own_arena.webots.stop()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()


def test_after_an_interrupted_call_the_next_answer_is_its_own(own_arena, monkeypatch):
    """After Ctrl-C in a notebook's cell, a late response must not be returned for a later call."""
    probe = own_arena.webots.observer
    before = probe.time()
    monkeypatch.setattr("palaestra_trainer.ros.tcpros_client.TcprosClient.receive", _interrupted)
    with pytest.raises(KeyboardInterrupt):
        probe.time()
    monkeypatch.undo()

    own_arena.robot.advance()

    assert probe.time() == pytest.approx(before + 0.192)


def _interrupted(_wire, ahead=0):
    del ahead
    raise KeyboardInterrupt


def test_a_simulator_takes_options_of_its_own(master):
    """A user passes the same options as in a TrainingJob."""
    del master
    webots = Webots("robotino", "arena", options=["--fault=start_refused:code=7"])

    with pytest.raises(SimulatorDead, match="ended with code 7"):
        webots.start()

    webots.close()


def test_a_simulator_that_is_not_known_is_refused_at_once(master):
    """The user must see the mistake when the facade is created, before a simulator starts."""
    del master

    with pytest.raises(ConfigurationError, match="gazebo"):
        Webots("robotino", "arena", driver="gazebo")


def test_a_simulator_that_does_not_start_raises_an_error_at_its_deadline(master):
    """The facade waits for a name that the world does not contain, and must not wait forever."""
    del master
    webots = Webots("nobody", "arena", start_deadline_s=1.0)

    with pytest.raises(SimulatorHung, match="did not start within 1 s"):
        webots.start()

    webots.close()
