"""A pod on this machine behaves like a pod of a kubelet: order, probes, restarts and shutdown."""

import asyncio
import errno
import os
import re
import signal
import subprocess

import pytest

from palaestra.local import orphan_killer
from palaestra.local.bounded_log import FIRST, LAST
from palaestra.local.errors import StartFailed
from palaestra.local.pod_spec import Probe
from palaestra.local.process import marked
from tests.failing import failing


def ready(stage, file="ready"):
    """Return a startup probe that succeeds once a file exists."""
    return Probe(
        command=("test", "-e", str(stage.folder / file)),
        period_s=0.02,
        timeout_s=10,
        failure_threshold=500,
    )


def test_containers_start_in_order_and_sidecars_stop_in_reverse(stage):
    """A simulator needs the ROS master from its start to its end, and the trainer needs both."""
    wait_for_all = f"until [ $(wc -l < {stage.folder}/events) = 2 ]; do sleep 0.01; done"

    code = stage.run(stage.sidecar("a"), stage.sidecar("b"), main=f"{wait_for_all}; event run")

    assert code == 0
    assert sorted(stage.events[:2]) == ["a start", "b start"]
    assert stage.events[2:] == ["main run", "b stop", "a stop"]


def test_a_sidecar_with_a_startup_probe_holds_back_its_successors(stage):
    """Without the probe, a simulator would start before the ROS master listens."""
    script = f"event start; sleep 0.3; event ready; touch {stage.folder}/ready; sleep 60"
    slow = stage.container("slow", script, startup=ready(stage))

    until = f"until grep -q next {stage.folder}/events; do sleep 0.01; done"

    stage.run(slow, stage.sidecar("next"), main=until, grace_s=0.2)

    assert stage.events[:3] == ["slow start", "slow ready", "next start"]


def test_a_sidecar_that_ends_is_started_again_while_the_pod_lives(stage):
    """A crash of one sidecar must not end a training."""
    crash = f"event start; [ $(wc -l < {stage.folder}/events) -ge 3 ] && sleep 60; exit 3"
    until = f"until [ $(wc -l < {stage.folder}/events) -ge 3 ]; do sleep 0.01; done; exit 7"

    code = stage.run(stage.container("flaky", crash), main=until, grace_s=0.2)

    assert code == 7
    assert stage.events == ["flaky start"] * 3


def test_a_sidecar_that_never_gets_ready_ends_the_pod_with_its_last_words(stage):
    """The user must see the program's output instead of a pod that waits forever."""
    broken = stage.container("broken", "echo port 11311 is taken; exit 1", startup=ready(stage))

    with pytest.raises(StartFailed, match=r"broken ended 3 times .*: .*port 11311 is taken"):
        stage.run(broken, main="event run")

    assert stage.events == []


def test_a_sidecar_that_hangs_before_it_is_ready_is_given_up_at_the_deadline(stage):
    """A program that neither ends nor becomes ready must not block the run."""
    stage.start_deadline_s = 0.3
    silent = stage.container("silent", "sleep 60", startup=ready(stage))

    with pytest.raises(StartFailed, match=r"silent was not ready within 0.3 s"):
        stage.run(silent, main="event run", grace_s=0.2)

    assert stage.events == []


def test_a_container_that_does_not_come_up_for_long_is_named_with_since_when(stage):
    """The user sees which container the run waits for, since when, and where its log is."""
    stage.long_s, stage.start_deadline_s = 0.05, 0.3
    silent = stage.container("silent", "sleep 60", startup=ready(stage))

    with pytest.raises(StartFailed):
        stage.run(silent, main="event run", grace_s=0.2)

    [line] = stage.shown
    assert re.fullmatch(r"waits for silent since \d\d:\d\d:\d\d; see .*/logs/silent\.log", line)


@pytest.mark.parametrize(
    ("first", "long_s", "lines"),
    # On a busy machine, a shell may need seconds for its first line.
    [("", 0.3, 1), ("echo up; ", 3, 0)],
    ids=["silent", "up"],
)
def test_a_trainer_is_waited_for_until_its_first_line(stage, first, long_s, lines):
    """After its first line, the trainer reports itself what it waits for."""
    stage.long_s = long_s

    stage.run(main=f"{first}sleep {1.2 * long_s}")

    assert len(stage.shown) == lines


def test_a_failed_startup_probe_restarts_the_sidecar(stage):
    """The kubelet also restarts a program that runs but never becomes ready."""
    file = stage.folder / "ready"
    probe = Probe(command=("test", "-e", str(file)), period_s=0.05, timeout_s=10, failure_threshold=40)
    script = f"event start; [ $(wc -l < {stage.folder}/events) = 2 ] && touch {file}; sleep 60"

    stage.run(stage.container("late", script, startup=probe), main="event run", grace_s=0.1)

    assert stage.events == ["late start", "late start", "main run"]


def test_a_failed_liveness_probe_restarts_the_sidecar(stage):
    """A sidecar that hangs is as useless as a sidecar that has crashed."""
    probe = Probe(command=("false",), period_s=0.05, timeout_s=10, failure_threshold=2)
    until = f"until [ $(wc -l < {stage.folder}/events) -ge 2 ]; do sleep 0.01; done"

    stage.run(stage.container("hung", "event start; sleep 60", liveness=probe), main=until, grace_s=0.1)

    assert stage.events[:2] == ["hung start", "hung start"]


def test_an_init_container_that_is_no_sidecar_runs_to_its_end_first(stage):
    """The container copies a program into a volume, from which the next container runs it."""
    copy = stage.container("copy", "sleep 0.1; event done", sidecar=False)

    stage.run(copy, stage.sidecar("a"), main="event run")

    assert stage.events[0] == "copy done"


def test_an_init_container_that_fails_ends_the_pod(stage):
    """The later containers need the result of the init container."""
    copy = stage.container("copy", "echo no space; exit 4", sidecar=False)

    with pytest.raises(StartFailed, match=r"copy ended with exit code 4: .*no space"):
        stage.run(copy, main="event run")

    assert stage.events == []


def test_stopping_asks_the_trainer_first_and_waits_for_its_checkpoint(stage):
    """The trainer needs its simulators while it saves its last checkpoint."""
    begin = f"until grep -q a {stage.folder}/events; do sleep 0.01; done; event run"
    main = f"trap 'sleep 0.2; event saved; exit 75' TERM; {begin}; while :; do sleep 0.02; done"

    code = stage.interrupt("main run", stage.sidecar("a"), main=main)

    assert code == 75
    assert stage.events == ["a start", "main run", "main saved", "a stop"]


def test_a_trainer_that_does_not_end_is_killed_when_the_grace_period_is_over(stage):
    """The sidecars have the same grace period, so they are killed too."""
    stubborn = "trap '' TERM; event run; while :; do sleep 0.02; done"

    code = stage.interrupt("main run", stage.container("a", stubborn), main=stubborn, grace_s=0.3)

    assert code == 128 + 9


def test_a_pod_that_is_stopped_during_its_start_never_starts_the_trainer(stage):
    """A user may type Ctrl-C before all sidecars are ready."""
    slow = stage.container("slow", "event start; sleep 60", startup=ready(stage))

    code = stage.interrupt("slow start", slow, main="event run", grace_s=0.2)

    assert code is None
    assert stage.events == ["slow start"]


def test_killing_ends_everything_at_once(stage):
    """After the second Ctrl-C, the user must not wait for anything."""
    stubborn = "trap '' TERM; event run; while :; do sleep 0.02; done"

    code = stage.interrupt("main run", stage.container("a", stubborn), main=stubborn, grace_s=1000, kill=True)

    assert code == 128 + 9


def test_what_a_container_left_behind_ends_with_the_pod(stage):
    """Such a process is in no process group of the pod, so only the marker finds it."""
    leave = "setsid bash -c 'trap \"\" TERM HUP; sleep 300' & disown; event run"

    code = stage.run(main=leave)

    assert code == 0


@pytest.mark.parametrize("lack", [None, errno.ENOSYS, errno.EPERM])
def test_what_was_left_behind_is_killed_on_a_system_without_pidfd(lack, monkeypatch):
    """Old kernels (ENOSYS), seccomp filters (EPERM) and some builds of Python make pidfd unavailable."""
    if lack is None:
        monkeypatch.delattr(os, "pidfd_open")
    else:
        monkeypatch.setattr(os, "pidfd_open", failing(lack))
    with subprocess.Popen(["sleep", "60"], env=marked({}, "pod", "main")) as left:
        killed = orphan_killer.kill_marked("pod/")
        if not killed:
            left.kill()

    assert (killed, left.returncode) == (1, -signal.SIGKILL)


def test_a_pod_runs_on_a_system_without_pidfd(stage, monkeypatch):
    """Without pidfd, the pod must detect in another way that its processes have ended."""
    monkeypatch.setattr(os, "pidfd_open", failing(errno.EPERM))

    until = f"until grep -q start {stage.folder}/events; do sleep 0.01; done; exit 7"

    code = stage.run(stage.sidecar("a"), main=until)

    assert code == 7
    assert stage.events == ["a start", "a stop"]


def test_a_program_that_does_not_exist_ends_as_in_a_shell(stage):
    """Users know exit code 127 from their shell."""
    pod = stage.pod(main="exec /no/such/program")

    code = asyncio.run(pod.run())

    assert code == 127


def test_output_goes_to_a_file_for_each_container(stage):
    """A user finds the cause of a crash in the file, which also has the output from before a restart."""
    said = f"until grep -q hello {stage.folder}/logs/chatty.log; do sleep 0.01; done"

    stage.run(
        stage.container("chatty", "echo hello; sleep 60"),
        main=f"{said}; echo out; echo err >&2",
        grace_s=0.1,
    )

    assert "hello\n" in (stage.folder / "logs" / "chatty.log").read_text()
    assert {"out", "err"} <= set((stage.folder / "logs" / "main.log").read_text().splitlines())


def test_a_log_of_a_program_that_prints_without_end_has_a_limit(stage):
    """A log without a limit would fill the disk and end the run.

    The log keeps its beginning and its end, and the program keeps its exit code.
    """
    code = stage.run(main='echo first; yes "$(printf %020000d 1)" | head -n 1500; echo last; exit 3')

    log = (stage.folder / "logs" / "main.log").read_text()
    assert code == 3
    assert len(log) <= FIRST + 2 * LAST < 1500 * 20_000
    assert log.startswith("first\n")
    assert log.endswith("\nlast\n--- main ended with exit code 3\n")
    assert "bytes were left out here" in log
