"""Reports of modules in a user's folder that shadow modules of Python or of Palaestra's dependencies."""

import os
import sys
from pathlib import Path

import pytest

from palaestra_protocol.shadowing import shadows


@pytest.fixture
def put(tmp_path):
    """Return a function that adds a file to a user's folder, and returns the shadowed modules."""

    def shadowed_with(name):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
        return shadows(str(tmp_path))

    return shadowed_with


@pytest.mark.parametrize("file", ["queue.py", "random.py", "types.py", "code.py", "email/__init__.py"])
def test_a_module_of_the_standard_library_is_named_with_the_file_and_the_remedy(put, tmp_path, file):
    """A library then fails with a traceback about a partially initialized module.

    The traceback has no remedy.
    """
    name = file.partition("/")[0].removesuffix(".py")

    found = put(file)

    assert found == [f"{tmp_path / file}: shadows the module {name} of Python's standard library; rename it"]


@pytest.mark.parametrize(
    "name",
    [
        "yaml",
        "gymnasium",
        "typing_extensions",
        "mujoco",
        "optuna",
        "rospy",
        "webots_ros",
        "palaestra_trainer",
    ],
)
def test_a_dependency_is_named_also_one_of_another_or_of_the_distribution(put, tmp_path, name):
    """A user's file may shadow a module of Palaestra, of ROS, of an extra, or of any dependency."""
    found = put(f"{name}.py")

    assert found == [f"{tmp_path / name}.py: shadows the module {name}, which Palaestra needs; rename it"]


@pytest.mark.parametrize(
    "file",
    [
        pytest.param("corridor.py", id="a name of the user's own"),
        pytest.param("pytest.py", id="a package that Palaestra does not need"),
        pytest.param("gymnasium/README", id="a folder without __init__.py"),
        pytest.param("queue.txt", id="a file that is no module"),
        pytest.param("sys.py", id="a module that is built into Python"),
    ],
)
def test_what_shadows_nothing_is_left_alone(put, file):
    """Python imports the right module in spite of these files."""
    assert put(file) == []


def test_folders_of_installed_packages_are_somebodys_choice(put):
    """On HPC clusters `module load` puts site-packages folders on PYTHONPATH, on purpose."""
    put("numpy-2.0.0.dist-info/METADATA")

    assert put("numpy.py") == []


def test_a_folder_that_is_missing_or_named_twice_changes_nothing(put, tmp_path):
    """Python ignores such an entry of the path."""
    [reason] = put("queue.py")

    assert shadows(f"{tmp_path}/missing:{tmp_path}") == [reason]
    assert shadows("") == []


def test_a_python_whose_library_is_no_folder_of_the_path_shadows_nothing(put, monkeypatch):
    """A frozen Python imports its library without `sys.path`, so no folder comes before the library."""
    library = str(Path(os.__file__).parent)
    monkeypatch.setattr(sys, "path", [folder for folder in sys.path if folder != library])

    assert put("corridor.py") == []
