"""A temporary folder exists as long as the process that made it, however that process ends."""

import errno
import io
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palaestra_protocol import temporary_folder as module
from palaestra_protocol.temporary_folder import temporary_folder
from tests.failing import failing
from tests.waiting import eventually

PATIENCE_S = 30.0
OWNER = """
import os, sys
from palaestra_protocol.temporary_folder import temporary_folder
with temporary_folder("own-") as folder:
    (folder.path / "below").mkdir()
    (folder.path / "below" / "file").write_text("x")
    print(folder.keeper, flush=True)
    sys.stdin.read()
    {end}
"""


@pytest.fixture
def owner(tmp_path):
    """Return a function that starts a process with a folder in `tmp_path`."""
    started = []

    def start(end="pass"):
        it = subprocess.Popen(
            [sys.executable, "-c", OWNER.format(end=end)],
            env={**os.environ, "TMPDIR": str(tmp_path)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(it)
        return it, int(it.stdout.readline())

    yield start
    for it in started:
        it.kill()
        it.communicate()


def pipes():
    """Return the open pipes of this process."""
    links = (each.readlink() for each in Path("/proc/self/fd").iterdir() if each.is_symlink())
    return {link.name for link in links if link.name.startswith("pipe:")}


def is_gone(pid):
    """Return whether no process has this ID."""
    return not Path(f"/proc/{pid}").exists()


def test_the_folder_is_private_and_exists_in_the_block_alone(tmp_path):
    """It may hold generated worlds and copied runs, which other users of the machine must not read."""
    with temporary_folder("own-", tmp_path) as folder:
        assert folder.path.parent == tmp_path
        assert folder.path.name.startswith("own-")
        assert folder.path.stat().st_mode & 0o777 == 0o700
        (folder.path / "file").touch()

    assert list(tmp_path.iterdir()) == []
    assert is_gone(folder.keeper)


def test_an_error_in_the_block_removes_the_folder(tmp_path):
    """The user must see the error of the block."""
    with pytest.raises(ZeroDivisionError), temporary_folder("own-", tmp_path):
        raise ZeroDivisionError

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("end", ["pass", "os._exit(3)", "os.kill(os.getpid(), 15)", "raise SystemExit(2)"])
def test_nothing_is_left_of_a_process_that_ends_itself(owner, tmp_path, end):
    """`os._exit` and SIGTERM run no clean-up of Python, but the kernel closes the pipe to the keeper."""
    it, keeper = owner(end)

    it.communicate("", PATIENCE_S)

    assert eventually(lambda: list(tmp_path.iterdir()) == [] and is_gone(keeper), PATIENCE_S)


def test_nothing_is_left_of_a_killed_process(owner, tmp_path):
    """No process can catch SIGKILL."""
    it, keeper = owner()

    it.kill()

    assert eventually(lambda: list(tmp_path.iterdir()) == [] and is_gone(keeper), PATIENCE_S)


def test_a_signal_for_all_processes_of_a_service_does_not_end_the_keeper(owner, tmp_path):
    """A stopped service sends SIGTERM to all its processes first, and then SIGKILL to those that remain."""
    it, keeper = owner()
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        os.kill(keeper, number)

    it.kill()

    assert eventually(lambda: list(tmp_path.iterdir()) == [], PATIENCE_S)


def test_without_a_keeper_the_block_still_removes_the_folder(owner, tmp_path):
    """A person may kill the keeper because she does not know what this process is for."""
    it, keeper = owner()
    os.kill(keeper, signal.SIGKILL)

    it.communicate("", PATIENCE_S)

    assert it.returncode == 0
    assert list(tmp_path.iterdir()) == []


def test_a_parent_that_does_not_exist_is_an_error_and_leaves_no_keeper(tmp_path):
    """The caller reports this error with the remedy."""
    with pytest.raises(FileNotFoundError), temporary_folder("own-", tmp_path / "missing"):
        pass


def test_a_forked_child_does_not_delay_the_end_of_the_block(tmp_path):
    """The child has a copy of the pipe, so the keeper would not see the end of the pipe."""
    with temporary_folder("own-", tmp_path) as folder:
        child = os.fork()
        if not child:
            signal.pause()
            os._exit(0)

    gone = is_gone(folder.keeper)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)

    assert gone
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("ignore:subprocess .* is still running:ResourceWarning")
def test_a_block_that_changes_the_working_folder_leaves_nothing(tmp_path, monkeypatch):
    """After the change, the block's relative path is wrong, but the keeper has the absolute path."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)

    with temporary_folder("own-", Path()):
        monkeypatch.chdir(tmp_path / "elsewhere")

    assert eventually(lambda: [each.name for each in tmp_path.iterdir()] == ["elsewhere"], PATIENCE_S)


def test_the_keeper_removes_the_folder_whose_path_it_reads(tmp_path, monkeypatch):
    """The owner can end by SIGKILL at any time after it has sent the path."""
    folder = tmp_path / "own-folder"
    (folder / "below").mkdir(parents=True)
    (folder / "below" / "file").touch()
    (tmp_path / "other").touch()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(os.fsencode(folder))))

    runpy.run_path(module.__file__, run_name="__main__")

    assert [each.name for each in tmp_path.iterdir()] == ["other"]


def test_a_system_that_starts_no_process_is_an_error_and_leaves_nothing_open(tmp_path, monkeypatch):
    """A pod may have reached its limit of processes. The caller continues with its old signals and pipes."""
    before, signals = pipes(), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    monkeypatch.setattr(subprocess, "Popen", failing(errno.EAGAIN))

    with pytest.raises(BlockingIOError), temporary_folder("own-", tmp_path):
        pass

    assert pipes() <= before
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == signals
    assert list(tmp_path.iterdir()) == []
