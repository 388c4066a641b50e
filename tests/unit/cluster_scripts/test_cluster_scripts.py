"""The cluster's scripts find the remains of a killed run, and report missing programs."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

CLUSTER = Path(__file__).parents[2] / "cluster"
SCRIPTS = sorted([*CLUSTER.rglob("*.sh"), CLUSTER / "node/entrypoint"])


@pytest.fixture
def run(tmp_path):
    """Return a function that runs a command in the cluster's folder, with an empty cache."""
    environment = {**os.environ, "PALAESTRA_CACHE": str(tmp_path / "cache")}
    environment.pop("KUBECONFIG", None)

    def run_command(*command, **more):
        return subprocess.run(
            [str(word) for word in command],
            cwd=CLUSTER,
            env=environment | more,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )

    return run_command


@pytest.fixture
def shell(run):
    """Return a function that runs a line of bash after it loads settings.sh and processes.sh."""
    return lambda line: run("bash", "-c", f"set -euo pipefail; . ./settings.sh; . ./processes.sh; {line}")


@pytest.mark.skipif(shutil.which("shellcheck") is None, reason="shellcheck is not installed")
def test_shellcheck_finds_nothing(run):
    """The linter shellcheck finds quoting mistakes that reviewers overlook."""
    result = run("shellcheck", "-x", *SCRIPTS)

    assert result.stdout == ""


def test_a_recorded_process_is_found_while_it_runs(shell):
    """The record stays valid after `exec`, so a script can find the cluster's container engine again."""
    result = shell("""
        (record_process "$CACHE.pid"; exec sleep 60) & started=$!
        wait_until 10 test -f "$CACHE.pid"
        [[ $(recorded_process "$CACHE.pid") == "$started" ]] && echo found
        kill $started; wait $started || true
        recorded_process "$CACHE.pid" || echo gone
    """)

    assert result.stdout.split() == ["found", "gone"]


def test_another_process_with_the_recorded_id_is_left_alone(shell):
    """The kernel reuses process ids, so without the start time an unrelated process would be killed."""
    result = shell("""
        echo "$$ 1 $(cat /proc/sys/kernel/random/boot_id)" >"$CACHE.pid"
        recorded_process "$CACHE.pid" || echo stranger
    """)

    assert result.stdout.strip() == "stranger"


def test_waiting_ends_at_its_deadline(shell):
    """If a cluster hangs, the script reports an error and does not wait for ever."""
    assert shell("wait_until 1 false || echo late").stdout.strip() == "late"


def test_a_lock_is_not_passed_on_to_what_is_started(shell):
    """A daemon that inherited the lock would block the next call for ever."""
    result = shell("""
        start() { sleep 60 & echo $! >"$CACHE.pid"; }
        locked name start
        timeout 5 bash -c ". ./settings.sh; locked name echo free"
        kill "$(cat "$CACHE.pid")"
    """)

    assert result.stdout.strip() == "free"


def test_the_remains_of_a_cluster_are_an_error(run, tmp_path):
    """The removal of a cluster ends with leftovers.sh, which reports remaining processes and folders."""
    state = tmp_path / "cache/kind"
    state.mkdir(parents=True)
    (state / "way").touch()

    with subprocess.Popen(
        ["/usr/bin/env", "--", "tail", "-f", state / "way"], stdout=subprocess.DEVNULL
    ) as left:
        result = run("./leftovers.sh")
        left.kill()

    assert result.returncode == 1
    assert f"folder {state}" in result.stdout
    assert f"process {left.pid}: " in result.stdout


def test_the_key_of_a_folder_changes_with_its_content_only(shell):
    """With a wrong key, a script would use an outdated node image or build a current one again."""
    result = shell(
        """
        mkdir -p "$CACHE"; HERE=$CACHE; mkdir a; echo 1 >a/x; echo 2 >a/y
        content_key a; touch a/x; content_key a; echo 3 >a/y; content_key a
    """.replace("mkdir a;", 'cd "$CACHE"; mkdir a;')
    )

    first, touched, changed = result.stdout.split()
    assert first == touched != changed


def test_asking_for_built_programs_builds_nothing(run):
    """Tests that need the programs are skipped if they were never built."""
    result = run("./programs.sh", "--built", "etcd")

    assert (result.returncode, result.stdout, result.stderr) == (3, "", "")


@pytest.mark.parametrize(
    ("command", "environment", "message"),
    [
        (["./programs.sh", "emacs"], {}, "emacs is not in"),
        (["./up.sh"], {"PALAESTRA_CLUSTER": "cloud"}, 'PALAESTRA_CLUSTER is "cloud", but it is one of'),
        (["./up.sh"], {"PALAESTRA_CLUSTER": "existing"}, "PALAESTRA_CLUSTER=existing needs KUBECONFIG"),
        (["./load.sh", "image.tar"], {}, "no cluster stands: make cluster"),
        (["./programs.sh", "etcd"], {"PATH": "/usr/bin:/bin"}, "Go is missing. Install Go"),
    ],
)
def test_an_error_has_a_remedy(run, command, environment, message):
    """A user must learn from the message what to do next."""
    if "Go" in message and shutil.which("go", path="/usr/bin:/bin"):
        pytest.skip("Go is installed next to the system's programs")

    result = run(*command, **environment)

    assert result.returncode == 1
    assert message in result.stderr


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can change to another user")
def test_missing_packages_are_one_line_to_type_for_who_is_not_root(run):
    """The script installs nothing without consent. A user who is not root gets the one command to run."""
    nobody = ("setpriv", "--reuid", "65534", "--clear-groups")
    if run(*nobody, "test", "-r", CLUSTER / "settings.sh").returncode:
        pytest.skip("another user can't read this checkout")

    result = run(*nobody, "./packages.sh", "no-such-package", HOME="/nonexistent")

    assert result.returncode == 1
    assert (
        "sudo apt-get update && sudo apt-get install -y --no-install-recommends no-such-package"
        in result.stderr
    )
