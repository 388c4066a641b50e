"""A job with `driver: webots`, whose image has the Webots of the tests."""

import shutil
from importlib.metadata import version

import pytest

from tests.chart.helm import ROOT
from tests.e2e.namespace import LONG_S
from tests.e2e.own_image import load_image, skip_without_archives
from tests.fake_webots.home import make_home
from tests.soak.jobs import LITTLE_DQN

pytestmark = pytest.mark.timeout(900)

IMAGE = "fake-webots:1"
DOCKERFILE = f"""FROM palaestra-stub:{version("palaestra-sim")}
COPY R2025a /opt/webots
COPY tests /opt/repository/tests
ENV WEBOTS_HOME=/opt/webots PATH=/opt/webots:/usr/local/bin:/usr/bin:/bin
"""


@pytest.fixture(scope="module")
def image(cluster, tmp_path_factory):
    """Return the name of an image with the Webots of the tests, on the nodes of the cluster."""
    del cluster
    skip_without_archives()
    folder = tmp_path_factory.mktemp("webots") / "context"
    folder.mkdir(mode=0o755)
    make_home(folder, python="python3", repository="/opt/repository")
    shutil.copytree(ROOT / "tests/fake_webots", folder / "tests/fake_webots")
    (folder / "Dockerfile").write_text(DOCKERFILE)
    return load_image(folder, IMAGE, "stub")


def test_a_policy_is_trained_in_webots(namespace, job, image):
    """In a restricted pod, Webots must find the controller that the sidecar writes, and start it."""
    simulator = {"name": "collect", "role": "Collect", "driver": "webots", "image": image}
    trainer = {
        "steps": 100,
        "evaluation": {"everySteps": 0},
        "checkpoint": {"everySteps": 50, "keep": 2},
        "algorithm": LITTLE_DQN,
    }
    namespace.apply(job("webots", simulators=[simulator], trainer=trainer))

    assert namespace.wait_for_end("webots", LONG_S) == "Succeeded"
    assert namespace.replica("webots")["step"] == 100
    assert namespace.replica("webots")["restarts"]["trainer"] == 0
