"""Programs start in a folder whose files have the names of modules of Python and of dependencies."""

import os
import subprocess
import sys
from importlib.metadata import distribution
from importlib.util import find_spec
from pathlib import Path

import pytest

PACKAGES = ("palaestra", "palaestra-sim", "palaestra-trainer")
WITH_CODE_OF_USERS = {
    "palaestra-train",
    "palaestra-eval",
    "palaestra-export",
    "palaestra-compare",
    "palaestra-try",
}
JOB = Path(__file__).parents[2] / "manifests/examples/tiny.yaml"
TRAP = "raise RuntimeError(f'{__file__} was imported')\n"
NEEDED = (
    "yaml",
    "numpy",
    "gymnasium",
    "torch",
    "pydantic",
    "structlog",
    "prometheus_client",
    "mujoco",
    "PIL",
)
# If one of these modules is shadowed, Python itself does not start, because it needs them to decode text and
# to compile. So Palaestra's programs cannot report these files.
UNAVOIDABLE = {"encodings", "__future__"}


# The standard library imports these modules to detect the operating system.
OF_WINDOWS = {"msvcrt", "nt", "winreg", "_winapi"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a file for every module of the standard library that can be shadowed."""
    made = tmp_path_factory.mktemp("own")
    for name in {*sys.stdlib_module_names, *NEEDED} - UNAVOIDABLE:
        if find_spec(name) or name in OF_WINDOWS:
            (made / f"{name}.py").write_text(TRAP)
    return made


def ran(program, folder, *arguments):
    """Run a program with a folder on PYTHONPATH, and return exit code, output and errors."""
    done = subprocess.run(
        [Path(sys.executable).with_name(program), *arguments],
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    "program",
    sorted({each.name for name in PACKAGES for each in distribution(name).entry_points}),
)
def test_each_program_starts_or_names_the_files(program, folder):
    """Users' code could import such a file instead of Python's module.

    So a program that runs users' code must name the files and stop. Every other program must start.
    """
    code, out, err = ran(program, folder, "--help")

    if program in WITH_CODE_OF_USERS:
        assert code == 2
        assert f"{program}: {folder}/queue.py: shadows the module queue of Python's standard library" in err
        assert out == ""
    else:
        assert (code, out.partition(":")[0]) == (0, "usage"), err


@pytest.mark.parametrize("name", ["re", "fnmatch", "msvcrt", "queue"])
@pytest.mark.parametrize("program", ["palaestra", "palaestra-train"])
def test_a_module_that_is_harmless_by_itself_is_found_too(program, name, tmp_path):
    """Python imports some modules at its start, so a harmless copy is loaded before our check runs.

    The check must still name its file.
    """
    (tmp_path / f"{name}.py").write_text("x = 1\n")
    arguments = ("plan", JOB) if program == "palaestra" else ("--help",)

    code, _, err = ran(program, tmp_path, *arguments)

    if program in WITH_CODE_OF_USERS:
        assert code == 2
        assert f"{tmp_path}/{name}.py: shadows the module {name} of Python's standard library" in err
    else:
        assert code == 0, err


def test_a_local_run_names_every_file_before_anything_starts(folder, tmp_path):
    """Without this check, the simulators would start, and only then the trainer would fail."""
    code, _, err = ran("palaestra", folder, "run", JOB, "--dir", tmp_path / "runs")

    assert code == 2
    for name in ("queue", "random", "types", "zoneinfo"):
        assert f"{folder}/{name}.py: shadows the module {name} of Python's standard library; rename it" in err
    assert not (tmp_path / "runs").exists()


def test_a_script_or_notebook_beside_such_a_file_gets_its_name(tmp_path):
    """The user must see this error, and not an unrelated one from NumPy or PyTorch."""
    (tmp_path / "queue.py").write_text("waypoints = []\n")

    done = subprocess.run(
        [sys.executable, "-c", "import palaestra_trainer"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )

    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        f"ImportError: {tmp_path}/queue.py: shadows the module queue of Python's standard library; rename it"
    )
