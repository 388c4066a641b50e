"""The chart that tests/cluster/kueue.sh installs is Kueue's own, except for the name of its image."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.chart.definitions import KUEUE, definitions
from tests.chart.helm import helm
from tests.cluster.kueue import manager, released

ROOT = Path(__file__).parents[3]
VALUES = """\
first: {image: other}
controllerManager:
  manager:
    image:
      # which
      repository: example.com/staging/kueue
      tag: main
      # when
      pullPolicy: Always
    podAnnotations: {}
viewer:
  backend:
    image:
      repository: example.com/staging/viewer
      tag: main
      pullPolicy: Always
"""


def made(folder):
    """Return the folder of Kueue's chart after the changes of kueue.sh."""
    shutil.copytree(definitions(KUEUE[0], "charts/kueue"), folder / "chart", copy_function=shutil.copyfile)
    (folder / "kueue").touch()
    files = (folder / "kueue", folder / "chart/values.yaml", folder / "image.tar")
    subprocess.run([sys.executable, "-m", "tests.cluster.kueue", *files], cwd=ROOT, timeout=60, check=True)
    return folder / "chart"


def test_the_chart_names_the_image_that_is_made_with_it(tmp_path):
    """A node of the test cluster cannot pull the staging image that Kueue's own chart always pulls."""
    objects = yaml.safe_load_all(helm("template", "kueue", str(made(tmp_path))))
    deployments = [each["spec"]["template"]["spec"] for each in objects if each["kind"] == "Deployment"]

    found = {(each["image"], each["imagePullPolicy"]) for pod in deployments for each in pod["containers"]}
    assert found == {(manager(tmp_path / "kueue").name, "IfNotPresent")}


def test_nothing_else_of_the_values_changes():
    """The tests must run Kueue with its own settings.

    The script changes only the image of Kueue's manager.
    """
    before, after = VALUES.splitlines(), released(VALUES).splitlines()

    changed = [new for old, new in zip(before, after, strict=True) if old != new]
    assert [line.split()[0] for line in changed] == ["repository:", "tag:", "pullPolicy:"]
    assert after[-3:] == before[-3:]


def test_values_without_that_image_are_an_error():
    """Another release of Kueue may name its image elsewhere.

    Without the error, its chart would silently stay unchanged.
    """
    with pytest.raises(LookupError, match="has no repository of an image below controllerManager"):
        released("controllerManager: {}\n")
