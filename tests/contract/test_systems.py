"""Programs on a system other than Linux: if a program needs Linux, it prints one sentence and no traceback.

The tests only simulate the system: they change `sys.platform`, and remove the modules and functions that
Python does not have on Windows.
"""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAMS = {
    name: target
    for package in ("operator", "sim_image", "trainer")
    for name, target in tomllib.loads((ROOT / package / "pyproject.toml").read_text())["project"][
        "scripts"
    ].items()
}
# Some modules of the standard library choose their content at import. They are imported before the test
# changes the system.
PRETEND = """
import sys, asyncio, ctypes, multiprocessing, os, select, signal, socket, urllib.request, uuid
system, target, *sys.argv = sys.argv[1:]
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name in {"fcntl", "grp", "pwd", "resource", "termios"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
if system == "win32":
    for name in ("fcntl", "grp", "pwd", "resource", "termios"):
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, Missing())
for module, names in ((select, ["epoll"]), (os, ["pidfd_open", "sched_getaffinity"]),
                      (signal, ["sigtimedwait"]), (socket, ["TCP_KEEPIDLE"])):
    for name in names:
        delattr(module, name)
sys.platform = system
module, _, function = target.partition(":")
import importlib
sys.exit(getattr(importlib.import_module(module), function)())
"""
JOB = "manifests/examples/tiny.yaml"


def on(system, program, *arguments):
    """Return exit code, output and lines of errors of a program on a simulated system."""
    done = subprocess.run(
        [sys.executable, "-c", PRETEND, system, PROGRAMS[program], program, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr.splitlines()


@pytest.mark.parametrize(
    ("system", "typed"),
    [
        ("darwin", ["palaestra", "run", JOB, "--dir", "/nonexistent"]),
        ("win32", ["palaestra", "run", JOB]),
        ("win32", ["palaestra", "sweep", JOB]),
        ("darwin", ["palaestra-sidecar"]),
        ("win32", ["palaestra-stub"]),
        ("win32", ["palaestra-mujoco"]),
        ("win32", ["palaestra-mock-robot"]),
        ("darwin", ["palaestra-train"]),
        ("darwin", ["palaestra-eval", "runs/a/0"]),
    ],
    ids=" ".join,
)
def test_a_program_that_needs_linux_says_so_in_one_sentence(system, typed):
    """A user who tries a program on such a system must read the remedy, not a traceback about fcntl."""
    code, out, errors = on(system, *typed)

    assert (code, out) == (2, "")
    [line] = errors
    fact = f"needs Linux, and this system is {system}"
    assert line.endswith(f" {fact}; run it on Linux, in a container or in WSL 2")
    assert line.startswith((f"{typed[0]}: ", f"{' '.join(typed[:2])}: ", "a run on this machine "))


@pytest.mark.parametrize(
    "arguments", [["explain", "trainer.steps"], ["plan", JOB], ["get", "--kubeconfig=none"]]
)
def test_commands_that_start_nothing_work_on_a_mac(arguments):
    """Many users control a cluster from a Mac."""
    code, _, errors = on("darwin", "palaestra", *arguments)

    assert (code, errors) == (0, []) or (code == 2 and errors[0].startswith("none: "))


def test_the_master_runs_on_every_system():
    """The ROS master uses only portable parts of Python, so it must start everywhere."""
    code, out, errors = on("darwin", "palaestra-ros-master", "--help")

    assert (code, errors) == (0, [])
    assert out.startswith("usage: palaestra-ros-master")
