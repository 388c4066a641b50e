"""A notebook as the training of a job, and the notebook that sends a job to a cluster."""

import pytest
import yaml

from tests.chart.helm import ROOT
from tests.e2e.namespace import LONG_S
from tests.e2e.test_pages import SESSION_S, at_home

NOTEBOOKS = ROOT / "examples" / "notebooks"
pytestmark = [pytest.mark.beside, pytest.mark.comes_late]


@pytest.mark.timeout(900)
def test_a_notebook_trains_as_the_program_of_a_job(namespace):
    """The notebook must run in a pod with the image of the notebook server and a read-only file system."""
    namespace.apply(yaml.safe_load((NOTEBOOKS / "6-train.yaml").read_text()))

    assert namespace.wait_for_end("notebook", LONG_S) == "Succeeded"
    assert namespace.replica("notebook")["step"] == 512


@pytest.mark.timeout(900)
def test_the_notebook_about_clusters_trains_and_fetches(namespace, tmp_path):
    """A reader runs all cells with the kubeconfig of her namespace."""
    (tmp_path / "5-cluster.ipynb").write_text((NOTEBOOKS / "5-cluster.ipynb").read_text())
    home = at_home(namespace, tmp_path)

    home.type_in("jupyter execute --inplace 5-cluster.ipynb", SESSION_S)

    printed = (tmp_path / "5-cluster.ipynb").read_text()
    assert "Succeeded 2000 " in printed
    assert "'model.zip'" in printed
    assert namespace.select("trainingjobs") == []
