"""The rules for all Dockerfiles, and a check that the linter hadolint finds no other mistake in them."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tools.images import webots
from tools.images.lock import PYTHON
from tools.images.recipes import recipes

ROOT = Path(__file__).parents[3]
KNOWN = {**recipes("debian"), "webots": webots.RECIPE}
RECIPES = tuple(KNOWN.values())
HADOLINT = Path(sys.executable).with_name("hadolint")
EXCUSES = ROOT / ".hadolint.yaml"


@pytest.fixture(params=RECIPES, ids=lambda recipe: recipe.name)
def recipe(request):
    """Return the recipe of each image."""
    return request.param


@pytest.fixture
def instructions(recipe):
    """Return the instructions of the image's Dockerfile."""
    return parsed(recipe)


def parsed(recipe):
    """Return a Dockerfile as pairs of instruction and argument, without comments and line continuations."""
    text = re.sub(r"^\s*#.*\n", "", (ROOT / recipe.dockerfile).read_text(), flags=re.MULTILINE)
    lines = re.sub(r"\\\n\s*", "", text).splitlines()
    return [tuple(line.split(maxsplit=1)) for line in lines if line.strip()]


def values(instructions, wanted):
    """Return the arguments of all instructions of one kind."""
    return [value for instruction, value in instructions if instruction == wanted]


def test_an_image_runs_as_a_user_without_rights(instructions):
    """The user must be a number, because a cluster that refuses root cannot look up a name."""
    assert values(instructions, "USER") == ["65532:65532"]
    assert [each for each, _ in instructions].index("USER") > [each for each, _ in instructions].index("RUN")


def test_an_image_runs_as_any_user_of_the_group_0(instructions):
    """OpenShift gives each namespace a user ID, which has no name and no home in the image."""
    folders = [
        words
        for run in values(instructions, "RUN")
        for words in re.findall(r"install --directory ([^&]*)", run)
    ]

    assert "HOME=/tmp USER=palaestra" in values(instructions, "ENV")
    assert all("--group=root --mode=775" in words for words in folders)


def test_an_image_has_debian_trixie_as_its_base_unless_another_is_named(instructions):
    """The tag `latest` may name another release of Debian tomorrow."""
    assert values(instructions, "FROM") == ["${BASE}"]
    assert "BASE=docker.io/library/debian:trixie-slim" in values(instructions, "ARG")


def test_every_use_of_apt_is_without_recommendations_and_cleans_up(instructions):
    """A file in a layer stays in the image, even if a later layer deletes it."""
    runs = [run for run in values(instructions, "RUN") if "apt-get" in run]

    assert runs
    for run in runs:
        assert "apt-get -qy install --no-install-recommends" in run
        assert run.index("apt-get -q update") < run.index("install")
        assert "apt-get -q clean" in run
        assert "rm -rf /var/lib/apt/lists/*" in run


def test_packages_are_installed_by_hash_from_the_context_alone(instructions):
    """A build uses no package index, so it works offline and cannot install a manipulated package."""
    *locked, ours = (run for run in values(instructions, "RUN") if "uv pip install" in run)

    assert all("--no-index" in run and "--no-cache" in run and "--no-deps" in run for run in (*locked, ours))
    assert all("--require-hashes" in run for run in locked)
    assert "--requirements /context/requirements.txt" in locked[0]
    assert "/context/packages/*.whl" in ours


def test_code_is_compiled_in_the_build_and_not_at_run_time(instructions):
    """In a pod the root file system is read-only, so Python cannot store bytecode there."""
    assert "PYTHONDONTWRITEBYTECODE=1" in values(instructions, "ENV")
    assert all("--compile-bytecode" in run for run in values(instructions, "RUN") if "uv pip" in run)


@pytest.mark.parametrize("name", ["stub", "mujoco", "webots", "trainer", "notebook"])
def test_an_image_with_ros_has_the_package_webots_ros(name):
    """Users' programs import this package. Palaestra's own code does not need it."""
    runs = values(parsed(KNOWN[name]), "RUN")

    distribution, *_ = [run for run in runs if "apt-get" in run]
    [ours] = [run for run in runs if "/context/packages/" in run]

    assert "python3-sensor-msgs" in distribution.split()
    assert "&& palaestra-webots-ros --importable /usr/share" in ours


@pytest.mark.parametrize("name", ["trainer", "notebook"])
def test_an_image_has_a_folder_for_a_project_of_the_user_s_own(name):
    """In a user's build, `palaestra-install` writes a project into this folder. Python searches it first."""
    [made] = [run for run in values(parsed(recipes("debian")[name]), "RUN") if "useradd" in run]

    assert "install --directory --owner=palaestra --group=root --mode=775 /opt/packages" in made
    assert "PYTHONPATH=/opt/packages" in values(parsed(recipes("debian")[name]), "ENV")


def test_what_changes_most_comes_last(instructions):
    """After a change of the sources, only the last layer is built again, not PyTorch's layer."""
    order = [f"{instruction} {value}" for instruction, value in instructions]

    assert order.index("ARG REQUIREMENTS") < order.index("ARG PACKAGES") < order.index("ARG VERSION")


def test_the_notebook_begins_with_the_layers_of_the_trainer():
    """PyTorch and the trainer's libraries have 1.4 GB, and equal layers are built and stored only once."""
    trainer, notebook = (parsed(recipes("debian")[name]) for name in ("trainer", "notebook"))
    shared = next(n for n, pair in enumerate(trainer) if "/context/requirements.txt" in pair[1]) + 1

    assert notebook[:shared] == trainer[:shared]


@pytest.mark.parametrize("name", ["mujoco", "webots"])
def test_a_simulator_begins_with_the_layers_of_the_stub(name):
    """A node that runs both images pulls Python and the ROS messages once."""
    stub, other = (parsed(KNOWN[each]) for each in ("stub", name))
    shared = stub.index(("ENV", "PYTHONDONTWRITEBYTECODE=1")) + 1

    assert other[:shared] == stub[:shared]


def test_webots_is_installed_from_the_archive_with_the_checked_digest():
    """The archive comes from a person, so the build checks its digest and its release."""
    instructions = parsed(KNOWN["webots"])
    [install] = [run for run in values(instructions, "RUN") if "/context/install.sh" in run]

    assert 'webots.tar.bz2 "${WEBOTS_SHA256}" "${WEBOTS}" "${WEBOTS_HOME}"' in install
    assert "WEBOTS=R2025a" in values(instructions, "ARG")
    assert {"WEBOTS_SHA256", "ASSETS_SHA256"} <= set(values(instructions, "ARG"))


def test_webots_image_has_an_x_server_and_opengl():
    """Webots needs an X server without a screen, and Mesa renders on the processor."""
    [install] = [run for run in values(parsed(KNOWN["webots"]), "RUN") if "xvfb" in run]

    assert {"libgl1-mesa-dri", "libegl1", "libxcb-cursor0", "bzip2"} <= set(install.split())


def test_mujoco_s_image_can_draw():
    """The image needs EGL, with Mesa's software renderer.

    PyOpenGL also needs libopengl.
    """
    install, *_ = [run for run in values(parsed(recipes("debian")["mujoco"]), "RUN") if "libegl1" in run]

    assert "libopengl0" in install.split()


def test_the_labels_say_what_is_inside(instructions, recipe):
    """`docker inspect` shows the labels without starting a container."""
    (labels,) = values(instructions, "LABEL")
    found = dict(re.findall(r'org\.opencontainers\.image\.(\w+)="([^"]*)"', labels))

    assert found["title"] == f"palaestra-{recipe.name}"
    assert found["version"] == "${VERSION}"
    assert found["revision"] == "${REVISION}"
    assert found["licenses"] == "Apache-2.0"


def test_no_dockerfile_copies_or_adds(instructions):
    """A mounted file is not part of a layer, but a copied file stays in the image."""
    assert not {"COPY", "ADD"} & {instruction for instruction, _ in instructions}


def test_folders_with_the_version_of_python_are_those_of_the_lock():
    """The Python version of the base image must match these folders and the lock file."""
    for recipe in RECIPES:
        found = re.findall(r"/python(3\.\d+)/", (ROOT / recipe.dockerfile).read_text())
        assert set(found) <= {PYTHON}


def linted(*options):
    """Return the hadolint rules that each Dockerfile breaks."""
    files = [
        str(path.relative_to(ROOT))
        for folders in ("*", "images/*")
        for path in ROOT.glob(f"{folders}/Dockerfile*")
    ]
    done = subprocess.run(
        [HADOLINT, "--no-fail", "--format=json", *options, *files],
        cwd=ROOT,
        capture_output=True,
        check=True,
        timeout=30,
    )
    broken = {file: set() for file in files}
    for each in json.loads(done.stdout):
        broken[each["file"]].add(each["code"])
    return broken


def test_hadolint_finds_nothing_in_any_dockerfile():
    """The linter also checks Dockerfiles without a recipe, and runs ShellCheck on their shell commands."""
    broken = linted()

    assert broken.keys() >= {recipe.dockerfile for recipe in RECIPES}
    assert not any(broken.values()), broken


def test_every_excuse_of_hadolint_is_needed():
    """An exception that is no longer needed would hide the next mistake."""
    broken = linted("--config=/dev/null")

    assert set(yaml.safe_load(EXCUSES.read_text())["ignored"]) == set().union(*broken.values())
