"""docs/start/your-environment.md in a cluster: a job runs an environment that a user's image contains."""

import pytest
import yaml

from tests.chart.helm import ROOT
from tests.e2e.jobs import SLOW
from tests.e2e.namespace import LONG_S
from tests.e2e.own_image import load_image, skip_without_archives
from tests.pages import fenced

pytestmark = pytest.mark.timeout(1200)

PAGE = dict(fenced((ROOT / "docs/start/your-environment.md").read_text()))
IMAGE = "corridor:1"
# One rollout and one episode. tests/integration/run tests that the page's environment can be learned.
SHORT = {
    "steps": 256,
    "evaluation": {"everySteps": 256, "episodes": 1, "confirmEpisodes": 2},
    "checkpoint": {"everySteps": 256, "keep": 2},
}
WHOSE = "import corridor, os; print(os.getuid(), os.stat(corridor.__file__).st_uid, corridor.__cached__)"


@pytest.fixture(scope="module")
def image(cluster, tmp_path_factory):
    """The page's image on the nodes of the cluster."""
    del cluster
    skip_without_archives()
    folder = tmp_path_factory.mktemp("own") / "corridor"
    folder.mkdir(mode=0o755)
    for name in ("python corridor.py", "dockerfile Dockerfile"):
        (folder / name.split()[1]).write_text(PAGE[name])
    return load_image(folder, IMAGE)


def test_an_environment_in_an_image_of_its_own_trains_in_a_restricted_pod(namespace, image):
    """The pod has no other file of the user, so the trainer must import the environment from the image."""
    job = yaml.safe_load(PAGE["yaml job.yaml"])
    job["spec"]["trainer"] |= {"image": image, **SHORT}
    job["spec"]["simulators"][0] |= SLOW  # the pod must still exist when the test checks it
    namespace.apply(job)
    pod = namespace.wait_for_pod("corridor", LONG_S)

    own, owner, compiled = namespace.execute(pod, "python3", "-c", WHOSE).split()

    assert own == owner == "65532"
    assert compiled.startswith("/opt/packages/__pycache__/corridor.")
    assert namespace.wait_for_end("corridor", LONG_S) == "Succeeded"
    assert namespace.replica("corridor")["step"] == 256
