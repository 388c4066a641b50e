"""The wheels of the three packages can be installed with `pip` into each supported Python."""

import json
import re
import subprocess
import tomllib
from functools import cache

import pytest
import yaml

from tests import bare_debian, wheels
from tests.wheels import ROOT, VERSIONS

DEADLINE_S = 240.0
JOB = {
    "apiVersion": "palaestra.dev/v1alpha1",
    "kind": "TrainingJob",
    "metadata": {"name": "bare"},
    "spec": {
        "simulators": [{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}],
        "trainer": {
            "environment": {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 20}},
            "algorithm": {"name": "A2C", "hyperparameters": {"n_steps": 20}},
            "steps": 100,
            "evaluation": {"everySteps": 100, "episodes": 1, "confirmEpisodes": 1},
        },
    },
}
NO_ROS = "import sys, importlib.util as util; sys.exit(any(map(util.find_spec, ('rospy', 'genpy'))))"


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """Return a function that installs the wheels for a version such as "3.12" and returns the programs."""
    built = cache(lambda: wheels.built(tmp_path_factory.mktemp("wheels")))

    @cache
    def installed(version):
        interpreter = wheels.python(version)
        if interpreter is None:
            pytest.skip(f"this machine has no Python {version} in /usr, /usr/local, pyenv or uv")
        try:
            return wheels.install(built(), interpreter, tmp_path_factory.mktemp("env") / version)
        except wheels.Uncached as error:
            pytest.skip(str(error))

    return installed


def typed(*words, **options):
    """Run a command and return the finished process."""
    return subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE_S, check=False, **options)


def helps(folder, *names):
    """Assert that each program prints its help and no error."""
    for name in names:
        shown = typed(folder / name, "--help")
        assert (shown.returncode, shown.stderr) == (0, ""), name


@pytest.mark.parametrize("version", VERSIONS)
def test_the_wheels_install_into_each_python(version, programs):
    """A user has the Python of a distribution, which may differ from ours, and no checkout."""
    folder = programs(version)

    assert typed(folder / "python", "-c", NO_ROS).returncode == 0, "this environment proves nothing"
    helps(folder, "palaestra", "palaestra-stub")


def test_a_job_is_trained_with_the_newest_python(programs, tmp_path):
    """Only a run shows that the newest Python has removed a module. A warning announces later removals."""
    folder = programs(next(filter(wheels.python, reversed(VERSIONS))))
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(JOB))

    run = typed(folder / "palaestra", "run", "job.yaml", cwd=tmp_path)
    evaluated = typed(folder / "palaestra-eval", "runs/bare/0", "--episodes", "1", cwd=tmp_path)

    assert run.returncode == 0, run.stdout + run.stderr
    assert json.loads((tmp_path / "runs/bare/0/summary.json").read_text())["steps"] == 100
    assert json.loads(evaluated.stdout)["episodes"] == 1, evaluated.stderr
    assert "Warning" not in run.stdout + run.stderr + evaluated.stderr


def test_every_program_of_the_wheels_starts_without_ros_and_without_a_checkout(programs, tmp_path):
    """A program that reads a file of the checkout, or imports an undeclared dependency, fails here."""
    folder = programs(next(filter(wheels.python, reversed(VERSIONS))))

    helps(folder, *SCRIPTS)
    assert typed(folder / "palaestra", "explain", "--skill").stdout.startswith("---\nname: palaestra\n")
    refused = typed(folder / "palaestra-webots-ros", tmp_path)
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1)
    assert "install python3-genpy" in refused.stderr


def test_a_job_is_trained_in_a_bare_debian_by_an_ordinary_user(programs, tmp_path):
    """The system has only a Python and the wheels: no ROS, no compiler, no checkout and no root."""
    if why := bare_debian.lack():
        pytest.skip(why)
    version = next(filter(wheels.python, reversed(VERSIONS)))
    folder, interpreter = programs(version), wheels.python(version)
    work = tmp_path / "work"
    work.mkdir()
    (work / "job.yaml").write_text(yaml.safe_dump(JOB))
    folders = [folder.parent, interpreter.resolve().parents[1], wheels.cache()]

    run = typed(*bare_debian.command([folder / "palaestra", "run", "job.yaml"], work, folders, interpreter))

    assert run.returncode == 0, run.stdout + run.stderr
    summary = work / "runs/bare/0/summary.json"
    assert json.loads(summary.read_text())["steps"] == 100
    assert summary.stat().st_uid == 65534


SCRIPTS = [
    name
    for package in ("operator", "sim_image", "trainer")
    for name in tomllib.loads((ROOT / package / "pyproject.toml").read_text())["project"]["scripts"]
]


def test_the_trainer_refuses_pythons_for_which_its_pytorch_has_no_wheel():
    """With the bound in requires-python, `pip` reports a wrong Python instead of a missing PyTorch."""
    bounds = tomllib.loads((ROOT / "trainer/pyproject.toml").read_text())["project"]["requires-python"]

    lowest, above = re.fullmatch(r">=3\.(\d+),<3\.(\d+)", bounds).groups()

    assert [f"3.{minor}" for minor in range(int(lowest), int(above))] == list(VERSIONS)
