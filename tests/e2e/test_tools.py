"""Commands that need a kubelet: `logs`, and `fetch` from a running pod or from a claim."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.e2e.jobs import tiny_job
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM

pytestmark = pytest.mark.timeout(1200)

COMMAND_S = 180
# This program replaces the training: it writes the files of a run and prints a line.
LEAVES_A_RUN = (
    "mkdir -p $PALAESTRA_RUN/tensorboard && printf weights > $PALAESTRA_RUN/model.zip"
    " && head -c 3000000 /dev/zero > $PALAESTRA_RUN/tensorboard/events && echo left it"
)
STAYS = "; trap exit TERM; sleep 3600 & wait"
LEFT = {"model.zip": b"weights", "tensorboard/events": bytes(3_000_000)}


def typed(namespace, *arguments):
    """Run a command of `palaestra`, and return its exit code and output."""
    program = Path(sys.executable).with_name("palaestra")
    done = subprocess.run(
        [program, *arguments, f"--namespace={namespace.name}"],
        capture_output=True, text=True, timeout=COMMAND_S, check=False, env=os.environ,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def found(folder):
    """Return the files below a folder."""
    return {str(each.relative_to(folder)): each.read_bytes() for each in folder.rglob("*") if each.is_file()}


def readers(namespace):
    """Return the pods that `fetch` created to read volumes."""
    return namespace.cluster.select("pods", namespace.name, "palaestra.dev/fetch")


@pytest.mark.beside
def test_a_run_that_goes_on_is_fetched_and_its_log_is_read(namespace, tmp_path):
    """A user can look at a run without disturbing its trainer."""
    namespace.apply(tiny_job("goes-on", script=LEAVES_A_RUN + STAYS))
    namespace.wait(lambda: "left it" in typed(namespace, "logs", "goes-on")[1], LONG_S)

    code, told = typed(namespace, "fetch", "goes-on", f"--dir={tmp_path}")

    assert code == 0, told
    assert {name: content for name, content in found(tmp_path / "goes-on/0").items() if name in LEFT} == LEFT
    assert readers(namespace) == []
    namespace.wait(lambda: namespace.replica("goes-on").get("phase") == "Running")
    assert typed(namespace, "logs", "goes-on", "--tail=1") == (0, "left it\n")


@pytest.mark.beside
def test_a_run_that_has_ended_is_fetched_from_its_claim(namespace, tmp_path):
    """The pod that reads the claim satisfies *restricted*, and `fetch` deletes it afterwards."""
    namespace.apply(tiny_job("ended", script=LEAVES_A_RUN))
    assert namespace.wait_for_end("ended", LONG_S) == "Succeeded"

    code, told = typed(namespace, "fetch", "ended", f"--dir={tmp_path}")

    assert code == 0, told
    assert {name: content for name, content in found(tmp_path / "ended/0").items() if name in LEFT} == LEFT
    assert [each for each in readers(namespace) if "deletionTimestamp" not in each["metadata"]] == []
    assert typed(namespace, "fetch", "ended", f"--dir={tmp_path}")[0] == 1


@pytest.mark.comes_late  # after the long run, which kills the operator repeatedly
def test_the_doctor_finds_nothing_wrong_where_jobs_run(namespace, cluster):
    """Jobs have trained in this cluster, so only one check warns: images with tags instead of digests."""
    cluster.rolled_out(SYSTEM, OPERATOR)
    code, told = typed(namespace, "doctor")

    findings = [line.split() for line in told.splitlines() if "->" not in line]
    assert {first for first, second, *_ in findings if second != "images"} == {"ok"}, told
    assert [first for first, second, *_ in findings if second == "images"] == ["warning"], told
    assert code == 0, told
