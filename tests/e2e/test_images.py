"""The built images: size, labels and user."""

import json
import os
import tarfile
from importlib.metadata import version

import pytest

from tests.e2e.long_run import operators
from tests.e2e.namespace import OPERATOR, SYSTEM, named
from tests.e2e.own_image import ARCHIVES
from tests.e2e.own_image import archives as built

pytestmark = pytest.mark.timeout(1200)

MOST_MB = {"stub": 500, "mujoco": 700, "operator": 200, "trainer": 2500, "notebook": 2500}
LABEL = "org.opencontainers.image."
NOBODY = "65532:65532"


@pytest.fixture(scope="module")
def archives():
    """Return the path of each image's archive, by the name of the image."""
    if ARCHIVES not in os.environ:
        pytest.skip("nobody says where the images' archives are; `make e2e` does")
    return built()


def configuration(archive):
    """Return the configuration of the image in a docker archive."""
    with tarfile.open(archive) as opened:
        (described,) = member(opened, "manifest.json")
        return member(opened, described["Config"])["config"]


def member(archive, name):
    """Return the content of a JSON file in an archive."""
    found = archive.extractfile(name)
    assert found, name
    return json.load(found)


@pytest.mark.parametrize("name", MOST_MB)
def test_an_image_holds_no_more_than_it_needs(name, archives):
    """Every new node pulls the image, so a large image delays jobs. docs/decisions/0005 lists the sizes."""
    assert archives[name].stat().st_size / 1e6 < MOST_MB[name]


@pytest.mark.parametrize("name", MOST_MB)
def test_an_image_says_what_it_is_and_is_run_by_nobody(name, archives):
    """The image names a user other than root, so `runAsNonRoot` admits a pod that names no user."""
    config = configuration(archives[name])

    assert config["User"] == NOBODY
    labels = {key.removeprefix(LABEL): value for key, value in config["Labels"].items()}
    assert labels["title"] == f"palaestra-{name}"
    assert labels["version"] == version("palaestra")
    assert labels["licenses"] == "Apache-2.0"
    assert labels["revision"]
    assert labels["description"]


@pytest.mark.after_the_kills
def test_the_operator_s_image_is_of_this_release(namespace, cluster):
    """A user copies the output of `palaestra --version` into a bug report, so the output must be right."""
    cluster.rolled_out(SYSTEM, OPERATOR)
    pod, *_ = namespace.wait(lambda: operators(namespace))

    said = cluster.execute(SYSTEM, named(pod), "operator", "palaestra", "--version")

    assert said.split() == ["palaestra", version("palaestra")]
