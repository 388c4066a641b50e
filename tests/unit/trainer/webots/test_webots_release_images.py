"""The image of a simulator comes from where the notebook's own image comes from."""

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots import Kubernetes
from palaestra_trainer.webots.launching.addresses import is_loopback
from palaestra_trainer.webots.launching.release_images import release_image


@pytest.mark.parametrize(
    ("beside", "image"),
    [
        ("registry.example:5000/lab/palaestra-notebook:9", "registry.example:5000/lab/palaestra-mujoco:9"),
        ("palaestra-trainer:9", "palaestra-mujoco:9"),
        ("palaestra-notebook@sha256:0", "palaestra-mujoco:0.1.0"),  # its digest is of another image
        ("lab/palaestra-notebooks:9", "palaestra-mujoco:0.1.0"),
        ("", "palaestra-mujoco:0.1.0"),
    ],
)
def test_registry_and_tag_are_those_of_the_notebook(beside, image, monkeypatch):
    """A cluster without internet has all images of a release in one registry."""
    monkeypatch.setattr("palaestra_trainer.webots.launching.release_images.version", lambda _: "0.1.0")

    assert release_image("mujoco", "kubernetes", beside) == image


def test_a_simulator_without_an_image_names_the_remedy():
    """Webots is large and has its own license, so a release has no image of it."""
    with pytest.raises(ConfigurationError, match=r"driver webots; give Kubernetes\(image=\.\.\.\) an image"):
        release_image("webots", "kubernetes")


def test_a_silence_that_a_busy_notebook_exceeds_is_refused():
    """A cell that computes for some seconds must not lose its simulator."""
    with pytest.raises(ConfigurationError, match="silence_s: 5 is refused; give 10 or more"):
        Kubernetes(silence_s=5)


def test_a_name_of_loopback_counts_as_its_address():
    """Other pods cannot reach a loopback address, whether it is written as a name or as numbers."""
    assert [is_loopback(host) for host in ("::1", "127.3.4.5", "localhost")] == [True, True, True]
    assert [is_loopback(host) for host in ("10.0.0.1", "master", "")] == [False, False, False]
