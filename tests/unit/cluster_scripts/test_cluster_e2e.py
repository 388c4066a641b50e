"""The state after `make e2e`: the real e2e.sh runs with fake programs that record their calls."""

import os
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.waiting import eventually

CLUSTER = Path(__file__).parents[2] / "cluster"
END_S = 30
CLEANING_S = 0.3  # interrupted tests clean up for this time, in which the cluster must still exist
INTERRUPTED = 130
TOLD = 'echo "$(basename "$0")" >>"$CALLS"\n'
PROGRAMS = {
    "tests/cluster/programs.sh": 'echo "$PWD/bin"',
    "tests/cluster/up.sh": TOLD + 'mkdir -p "$PALAESTRA_CACHE/kind"; touch "$PALAESTRA_CACHE/kind/way"',
    "tests/cluster/down.sh": TOLD + 'rm -rf "$PALAESTRA_CACHE/kind"',
    "tests/cluster/load.sh": "",
    "tools/images.sh": "echo stub=stub.tar",
    "bin/kubectl": "",
}
# The shebang line names the interpreter and not the checkout's virtual environment, whose path may contain
# a space. Like pytest, this program cleans up after Ctrl-C, unless the signal is ignored.
TESTS = f"""#!{os.path.realpath(sys.executable)} -IS
import os, signal, sys, time

def tell(what):
    with open(os.environ["CALLS"], "a") as calls:
        print(what, file=calls)

try:
    tell("tests")
    if code := os.environ["TESTS_END"]:
        sys.exit(int(code))
    signal.pause()
except KeyboardInterrupt:
    time.sleep({CLEANING_S})
    tell("cleaned")
    sys.exit(2)
"""


class E2e:
    """A copy of e2e.sh in its own folder; `calls` lists the calls that it made, in order."""

    def __init__(self, folder):
        self.cache = folder / "cache"
        self._folder = folder
        self._calls = folder / "calls"
        for name, does in PROGRAMS.items():
            self._write(name, f"#!/usr/bin/env bash\nset -e\n{does}\n")
        self._write(".venv/bin/pytest", TESTS)
        for name in ("e2e.sh", "settings.sh"):
            shutil.copy(CLUSTER / name, folder / "tests/cluster" / name)

    @contextmanager
    def started(self, tests_end, *, messages=subprocess.DEVNULL, **environment):
        """Run the script, and kill all its processes at the end.

        The tests exit with the code `tests_end`; if it is empty, they run until they are interrupted. The
        script writes its messages to the file `messages`.
        """
        kept = {name: value for name, value in os.environ.items() if name in {"PATH", "HOME", "LANG"}}
        own = {"PALAESTRA_CACHE": str(self.cache), "CALLS": str(self._calls), "TESTS_END": tests_end}
        with subprocess.Popen(
            [self._folder / "tests/cluster/e2e.sh"],
            env=kept | own | environment,
            stderr=messages,
            start_new_session=True,
        ) as process:
            try:
                yield process
            finally:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)

    def run(self, tests_end="0", *, messages=subprocess.DEVNULL, **environment):
        """Run the script to its end and return its exit code."""
        with self.started(tests_end, messages=messages, **environment) as process:
            return process.wait(END_S)

    @property
    def calls(self):
        """Return the recorded calls, in order."""
        return self._calls.read_text().split() if self._calls.exists() else []

    def stands(self, *, by_e2e):
        """Create the files of a running cluster that a person, or a killed run of the script, started."""
        state = self.cache / "kind"
        state.mkdir(parents=True)
        (state / "way").touch()
        if by_e2e:
            (state / "by-e2e").touch()

    def _write(self, name, text):
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)


@pytest.fixture
def e2e(tmp_path):
    """Return the script without a running cluster."""
    return E2e(tmp_path)


@pytest.mark.parametrize("code", ["0", "1"])
def test_the_cluster_goes_however_the_tests_end(e2e, code):
    """A forgotten cluster would use the memory of the machine.

    The script still returns the exit code of the tests.
    """
    assert e2e.run(code) == int(code)

    assert e2e.calls == ["up.sh", "tests", "down.sh"]
    assert not (e2e.cache / "kind").exists()


def test_the_cluster_goes_although_the_log_is_on_a_full_disk(e2e):
    """The cluster often fills the disk itself, and only its removal makes space again."""
    with Path("/dev/full").open("w") as log:
        assert e2e.run("1", messages=log) == 1

    assert e2e.calls == ["up.sh", "tests", "down.sh"]


def test_the_cluster_goes_although_nobody_reads_the_messages(e2e):
    """In `make e2e 2>&1 | head`, `head` ends before the script does."""
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as log:
        e2e.run(messages=log)

    assert e2e.calls[-1] == "down.sh"
    assert not (e2e.cache / "kind").exists()


def ctrl_c(process):
    """Interrupt every process in the foreground of the terminal."""
    os.killpg(process.pid, signal.SIGINT)


def terminate(process):
    """Terminate only the script, as a shutdown of the machine does."""
    process.terminate()


@pytest.mark.parametrize("stop", [ctrl_c, terminate])
def test_a_signal_lets_the_tests_clean_up_and_then_removes_the_cluster(e2e, stop):
    """The tests are interrupted only once, because a second interruption would stop their cleanup."""
    with e2e.started(tests_end="") as process:
        eventually(lambda: "tests" in e2e.calls)
        stop(process)
        assert process.wait(END_S) == INTERRUPTED

    assert e2e.calls == ["up.sh", "tests", "cleaned", "down.sh"]


def test_a_signal_during_the_start_of_the_cluster_removes_it(e2e, tmp_path):
    """The script handles the signal once up.sh has ended, and then a whole cluster stands."""
    up = tmp_path / "tests/cluster/up.sh"
    wait = 'mkdir -p "$PALAESTRA_CACHE"; until [[ -e $PALAESTRA_CACHE/go ]]; do sleep 0.05; done\n'
    up.write_text(up.read_text().replace(TOLD, TOLD + wait))
    with e2e.started(tests_end="") as process:
        eventually(lambda: "up.sh" in e2e.calls)
        terminate(process)
        (e2e.cache / "go").touch()
        assert process.wait(END_S) == INTERRUPTED

    assert e2e.calls == ["up.sh", "down.sh"]


def test_a_script_that_is_held_up_was_interrupted_nevertheless(e2e):
    """On a busy machine the tests may end before the script receives Ctrl-C.

    A delayed script must still report the interruption.
    """
    with e2e.started(tests_end="") as process:
        eventually(lambda: "tests" in e2e.calls)
        process.send_signal(signal.SIGSTOP)
        ctrl_c(process)
        eventually(lambda: "cleaned" in e2e.calls)
        process.send_signal(signal.SIGCONT)
        assert process.wait(END_S) == INTERRUPTED

    assert e2e.calls == ["up.sh", "tests", "cleaned", "down.sh"]


def test_images_that_cannot_be_built_end_it_without_a_test(e2e, tmp_path):
    """The script starts the cluster during the build of the images, so it must remove the cluster too."""
    (tmp_path / "tools/images.sh").write_text("#!/bin/sh\nexit 1\n")

    assert e2e.run() == 1

    assert e2e.calls == ["up.sh", "down.sh"]


def test_what_a_killed_run_left_behind_goes_first(e2e):
    """The file `by-e2e` shows that the killed run started the cluster, so nobody uses it."""
    e2e.stands(by_e2e=True)

    assert e2e.run() == 0

    assert e2e.calls == ["down.sh", "up.sh", "tests", "down.sh"]


def test_a_cluster_that_stood_before_is_left(e2e):
    """A person started this cluster and may still use it."""
    e2e.stands(by_e2e=False)

    assert e2e.run("1") == 1

    assert e2e.calls == ["up.sh", "tests"]


def test_a_cluster_that_is_to_be_kept_is_not_taken_by_the_next_run(e2e):
    """With KEEP=1 the cluster belongs to the person who ran the script."""
    assert e2e.run(KEEP="1") == 0
    assert e2e.run() == 0

    assert e2e.calls == ["up.sh", "tests", "up.sh", "tests"]
