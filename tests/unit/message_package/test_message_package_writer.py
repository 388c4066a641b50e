"""`palaestra-webots-ros` writes a ROS package into a new folder, over another package, and on a full disk."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from palaestra_sim.message_package.cli import main
from palaestra_sim.message_package.files import package_files
from palaestra_sim.message_package.package_writer import make_importable, write

COMMAND = Path(sys.executable).with_name("palaestra-webots-ros")
SYSTEM_PYTHON = "/usr/bin/python3"  # has genpy and Debian's messages, but no package of Palaestra


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return the folder of a written package, which the tests only read."""
    return write(tmp_path_factory.mktemp("share"))


def contents(folder):
    """Return the text of every file by its path, without Python's bytecode."""
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }


def python(code, *arguments):
    """Return the output of a Python program."""
    done = subprocess.run(
        [SYSTEM_PYTHON, "-c", code, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return done.stdout.strip()


def test_the_folder_holds_every_file_of_the_package_and_nothing_besides(package):
    """ROS's tools search every folder on ROS_PACKAGE_PATH, so an extra file could be taken for a package."""
    assert contents(package) == dict(package_files())
    assert [path.name for path in package.parent.iterdir()] == ["webots_ros"]


def test_the_bytecode_names_the_files_where_they_are(package):
    """A read-only container keeps this bytecode, and a traceback shows the paths that it contains."""
    code = "import sys; sys.path.append(sys.argv[1]); import webots_ros.srv._set_int as module\n"
    code += "print(module.__cached__, module.set_intRequest.serialize.__code__.co_filename)"

    cached, source = map(Path, python(code, package / "src").split())

    assert cached.exists()
    assert source == package / "src/webots_ros/srv/_set_int.py"


def test_a_package_of_an_earlier_release_is_replaced_as_a_whole(tmp_path):
    """If old files stayed, programs could still import a removed type."""
    (write(tmp_path) / "srv/gone.srv").write_text("---\n")

    package = write(tmp_path)

    assert contents(package) == dict(package_files())
    assert list(tmp_path.iterdir()) == [package]


def test_a_failed_write_leaves_the_earlier_package_as_it_was(tmp_path):
    """The test limits files to 3,000 bytes, like a disk that becomes full half-way."""
    earlier = write(tmp_path) / "srv/earlier.srv"
    earlier.write_text("---\n")

    done = subprocess.run(
        [COMMAND, tmp_path],
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},  # Python would leave incomplete bytecode files
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000)),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"palaestra-webots-ros: {tmp_path}: File too large; choose a folder to write to\n"
    assert earlier.exists()
    assert [path.name for path in tmp_path.iterdir()] == ["webots_ros"]


def test_a_package_of_another_origin_is_left_alone(tmp_path, capsys):
    """The package may be the one of Webots, built from its sources."""
    other = tmp_path / "webots_ros/package.xml"
    other.parent.mkdir()
    other.write_text("<package><name>webots_ros</name></package>")

    code = main([str(tmp_path)])

    assert code == 2
    assert "webots_ros: is a package that Palaestra did not write; use it as it is" in capsys.readouterr().err
    assert contents(tmp_path) == {"webots_ros/package.xml": other.read_text()}


def test_a_folder_that_cannot_be_made_is_named(tmp_path, capsys):
    """The user must choose another folder or run the command as another user."""
    (tmp_path / "share").write_text("")

    code = main([str(tmp_path / "share")])

    assert code == 2
    assert f"{tmp_path}/share: File exists; choose a folder to write to" in capsys.readouterr().err


IMPORTED = "import site, sys; site.addsitedir(sys.argv[1]); sys.path.append(sys.argv[2])\n"
IMPORTED += "import webots_ros.srv; print(webots_ros.srv.set_int)"


def test_a_python_whose_packages_name_it_imports_it(package, tmp_path):
    """A notebook or a program in a pod does not set PYTHONPATH, and must still find the package."""
    make_importable(package, tmp_path)

    assert python(IMPORTED, tmp_path, tmp_path / "nothing") == "<class 'webots_ros.srv._set_int.set_int'>"


def test_an_installed_webots_ros_is_imported_even_if_it_comes_last(package, tmp_path):
    """An installed package fits the user's Webots, so it has priority.

    But Palaestra's virtual environment is searched before the distribution's packages.
    """
    make_importable(package, tmp_path)
    installed = tmp_path / "dist-packages/webots_ros"
    (installed / "srv").mkdir(parents=True)
    (installed / "__init__.py").write_text("")
    (installed / "srv/__init__.py").write_text("set_int = 'of the distribution'\n")

    assert python(IMPORTED, tmp_path, tmp_path / "dist-packages") == "of the distribution"
