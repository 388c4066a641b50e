"""`palaestra-install` adds a user's project to an image, and changes nothing else in the image."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from palaestra_trainer.cli.image_install import main

PROJECT = """
[project]
name = "corridor"
version = "1.0"
dependencies = [{dependencies}]
[build-system]
requires = ["{backend}"]
"""
BACKENDS = ["hatchling", "setuptools"]


@pytest.fixture
def target(tmp_path, monkeypatch):
    """Return the folder that is on PYTHONPATH; uv is on the PATH, but no package index can be reached."""
    made = tmp_path / "packages"
    made.mkdir()
    monkeypatch.setenv("PYTHONPATH", str(made))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:/usr/bin:/bin")
    monkeypatch.setenv("UV_NO_INDEX", "1")
    return made


@pytest.fixture
def folder(tmp_path):
    """Return a folder with one module and no project file, as a user has it after a training."""
    made = tmp_path / "src"
    made.mkdir()
    (made / "corridor.py").write_text("LENGTH_M = 3\n")
    return made


@pytest.fixture
def project(folder):
    """Return a function that makes the folder a project, with a pyproject.toml."""

    def make(*dependencies, backend="hatchling"):
        listed = ", ".join(f'"{each}"' for each in dependencies)
        text = PROJECT.format(dependencies=listed, backend=backend)
        named = {"hatchling": "hatchling.build", "setuptools": "setuptools.build_meta"}[backend]
        hatch = '[tool.hatch.build.targets.wheel]\ninclude = ["corridor.py"]\n'
        setuptools = '[tool.setuptools]\npy-modules = ["corridor"]\n'
        own = hatch if backend == "hatchling" else setuptools
        (folder / "pyproject.toml").write_text(f'{text}build-backend = "{named}"\n{own}')
        return folder

    return make


@pytest.fixture
def companion(tmp_path, monkeypatch):
    """Return a function that gives uv a wheel which has a requirement itself."""

    def make(needs):
        name = "companion-1.0.dist-info"
        with zipfile.ZipFile(tmp_path / "companion-1.0-py3-none-any.whl", "w") as wheel:
            wheel.writestr("companion.py", "")
            meta = f"Metadata-Version: 2.1\nName: companion\nVersion: 1.0\nRequires-Dist: {needs}\n"
            wheel.writestr(f"{name}/METADATA", meta)
            wheel.writestr(f"{name}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
            wheel.writestr(f"{name}/RECORD", "")
        monkeypatch.setenv("UV_FIND_LINKS", str(tmp_path))

    return make


def modules(target):
    """Return the names of the modules that are installed in the folder."""
    return {path.stem for path in target.glob("*.py")} | {
        path.parent.name for path in target.glob("*/__init__.py")
    }


def refusal(capfd, *arguments):
    """Return the message with which a folder is rejected."""
    assert main([str(each) for each in arguments]) == 2
    return capfd.readouterr().err


def test_a_bare_folder_of_modules_is_importable_and_compiled(folder, target):
    """The root file system of a pod is read-only, so byte code would be compiled again at each start."""
    assert main([str(folder)]) == 0

    said = subprocess.run(
        [sys.executable, "-c", "import corridor; print(corridor.LENGTH_M, corridor.__cached__)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    assert said[0] == "3"
    assert Path(said[1]).is_relative_to(target)
    assert Path(said[1]).is_file()


def test_what_a_training_leaves_behind_stays_out(folder, target):
    """A policy, a virtual environment and a Git repository may have gigabytes."""
    for name in ("runs", ".venv", ".git", "__pycache__"):
        (folder / name).mkdir()

    assert main([str(folder)]) == 0

    assert {path.name for path in target.iterdir()} == {"corridor.py", "__pycache__"}
    assert not list((target / "__pycache__").glob("*.py"))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_project_needs_no_index_if_the_image_has_its_dependencies(project, target, backend):
    """A machine may reach no package index.

    The project's folder is mounted read-only, so the build must not write into it.
    """
    folder = project("gymnasium>=1", "torch", "stable-baselines3", backend=backend)
    before = sorted(folder.rglob("*"))

    assert main([str(folder)]) == 0

    assert modules(target) == {"corridor"}
    assert sorted(folder.rglob("*")) == before


def test_a_dependency_that_the_image_lacks_comes_without_what_the_image_has(project, target, companion):
    """A second copy of PyTorch would have 5 GB."""
    companion("torch")

    assert main([str(project("companion"))]) == 0

    assert modules(target) == {"companion", "corridor"}


@pytest.mark.parametrize(
    ("needs", "fact"),
    [
        ("gymnasium>=99", "corridor: needs gymnasium>=99, and the image has 1."),
        ("companion", "companion: needs torch>=99, and the image has 2."),
        ("stable-baselines3[tests]", "corridor: needs pytest-cov, which the image does not have"),
    ],
    ids=["direct", "indirect", "extra"],
)
def test_what_does_not_fit_the_image_is_refused_and_installs_nothing(
    project, target, companion, capfd, needs, fact
):
    """Without the check, the project would fail in a pod an hour later, with a traceback."""
    companion("torch>=99")

    assert fact in refusal(capfd, project(needs))
    assert not list(target.iterdir())


@pytest.mark.parametrize("name", ["random", "gymnasium"])
def test_a_module_that_hides_one_of_the_image_is_refused(folder, target, capfd, name):
    """The user's folder is first on the import path of every program of the image."""
    (folder / f"{name}.py").touch()

    assert f"{name}: the project would hide the image's module of this name; rename it" in refusal(
        capfd, folder
    )
    assert not list(target.iterdir())


def test_a_newer_version_replaces_an_older_one(project, target):
    """A user may build an image on top of the previous image."""
    folder = project()
    assert main([str(folder)]) == 0
    file = folder / "pyproject.toml"
    file.write_text(file.read_text().replace('version = "1.0"', 'version = "2.0"'))
    (folder / "corridor.py").write_text("LENGTH_M = 4\n")

    assert main([str(folder)]) == 0

    assert (target / "corridor.py").read_text() == "LENGTH_M = 4\n"
    assert [path.name for path in target.glob("*.dist-info")] == ["corridor-2.0.dist-info"]


def test_a_module_that_a_newer_version_lacks_is_gone(project, target):
    """If the old module stayed, a job could use an environment that the project has deleted."""
    folder = project()
    file = folder / "pyproject.toml"
    file.write_text(file.read_text().replace('["corridor.py"]', '["corridor.py", "hall.py"]'))
    (folder / "hall.py").write_text("")
    assert main([str(folder)]) == 0
    assert modules(target) == {"corridor", "hall"}
    (folder / "hall.py").unlink()

    assert main([str(folder)]) == 0

    assert modules(target) == {"corridor"}


def test_a_folder_without_a_module_is_refused(tmp_path, target, capfd):
    """An image without any installed module would look like a success."""
    assert f"{target}: holds neither a module nor a package" in refusal(capfd, target)
    assert "is not a folder; name the folder with your project" in refusal(capfd, tmp_path / "missing")


def test_a_folder_that_is_itself_a_package_is_refused(folder, target, capfd):
    """The modules of the package would be imported by other names than their own imports use."""
    (folder / "__init__.py").touch()

    assert f"{folder}: is itself a package; name the folder that holds your modules" in refusal(capfd, folder)
    assert not list(target.iterdir())


def test_without_a_folder_on_the_path_there_is_no_place(folder, monkeypatch, capfd):
    """On a laptop, a user puts the folder itself on PYTHONPATH, and installs nothing."""
    monkeypatch.delenv("PYTHONPATH", raising=False)

    assert "PYTHONPATH: does not begin with a folder" in refusal(capfd, folder)


def test_a_project_that_cannot_be_built_shows_why(folder, target, capfd):
    """The message of uv names the line with the mistake; the last line reports that nothing was installed."""
    (folder / "pyproject.toml").write_text("[project]\nname = 'corridor'\n")

    said = refusal(capfd, folder)

    assert "version" in said
    assert "uv could not install the project; its message is above" in said
    assert not list(target.iterdir())
