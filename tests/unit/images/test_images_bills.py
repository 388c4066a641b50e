"""A bill of materials lists the packages that an image contains, not those that somebody requested."""

import io
import json
import tarfile
from importlib.metadata import version
from pathlib import Path

import pytest
from cyclonedx.validation.json import JsonStrictValidator

from tools.images import bills
from tools.images.building import Built
from tools.images.errors import ImagesError

ROOT = Path(__file__).parents[3]
STATUS = """Package: libc6
Status: install ok installed
Architecture: amd64
Version: 2.41-12

Package: gone
Status: deinstall ok config-files
Architecture: all
Version: 1.0
"""
METADATA = "Metadata-Version: 2.4\nName: {name}\nVersion: {version}\n\nSome words.\n"
SITE = "opt/palaestra/lib/python3.13/site-packages"


def add(archive, name, content):
    """Add a file to a tar archive."""
    member = tarfile.TarInfo(name)
    member.size = len(content)
    archive.addfile(member, io.BytesIO(content))


def layer(*files):
    """Return a layer: the bytes of a tar archive with files, each with its path and its text."""
    written = io.BytesIO()
    with tarfile.open(fileobj=written, mode="w") as archive:
        for path, text in files:
            add(archive, path, text.encode())
    return written.getvalue()


def metadata(name, version="1.2"):
    """Return the path and the text of the metadata file of an installed wheel."""
    return f"{SITE}/{name}-{version}.dist-info/METADATA", METADATA.format(name=name, version=version)


@pytest.fixture
def image(tmp_path):
    """Return a function that writes an image with some layers, as an engine saves it."""

    def write(*layers):
        path = tmp_path / "operator-0123.tar"
        names = [f"{place}/layer.tar" for place, _ in enumerate(layers)]
        with tarfile.open(path, "w") as archive:
            add(archive, "manifest.json", json.dumps([{"Layers": names}]).encode())
            for name, content in zip(names, layers, strict=True):
                add(archive, name, content)
        return Built(reference="docker.io/library/palaestra-operator:0.1.0", archive=path)

    return write


def listed(bill):
    """Check the format of a bill, and return its package URLs."""
    text = bill.read_text()
    assert JsonStrictValidator(bills.VERSION).validate_str(text) is None
    return [component["purl"] for component in json.loads(text)["components"]]


def test_a_bill_of_an_image_lists_its_packages_of_debian_and_of_python(image):
    """With the bill, a scanner can find the images that a new vulnerability affects."""
    debian = layer(("var/lib/dpkg/status", STATUS))
    built = image(debian, layer(metadata("Ruamel.Yaml"), metadata("numpy", "2.5")))

    bill = bills.of_image(built)

    assert bill.name == "operator-0123.tar.cdx.json"
    assert listed(bill) == [
        "pkg:deb/debian/libc6@2.41-12?arch=amd64",
        "pkg:pypi/numpy@2.5",
        "pkg:pypi/ruamel-yaml@1.2",
    ]
    named = json.loads(bill.read_text())["metadata"]["component"]
    assert (named["name"], named["version"], named["type"]) == ("palaestra-operator", "0.1.0", "container")


def test_a_package_that_a_later_layer_removes_is_not_listed(image):
    """The trainer's Dockerfile removes packages that only the build needs, and no bill may list them."""
    installed = layer(metadata("hatchling"), metadata("numpy"))
    removal = layer((f"{SITE}/.wh.hatchling-1.2.dist-info", ""))

    bill = bills.of_image(image(installed, removal))

    assert listed(bill) == ["pkg:pypi/numpy@1.2"]


def test_a_folder_that_a_later_layer_replaces_is_not_listed(image):
    """The whiteout file of the later layer hides the whole folder of the earlier one."""
    replacement = layer((f"{SITE}/.wh..wh..opq", ""), metadata("numpy", "2.5"))

    bill = bills.of_image(image(layer(metadata("numpy")), replacement))

    assert listed(bill) == ["pkg:pypi/numpy@2.5"]


def test_a_bill_is_the_same_for_the_same_image_and_goes_with_its_archive(image):
    """A person can compare two bills, and the bill of a removed image is deleted."""
    built = image(layer(metadata("numpy")))
    first = bills.of_image(built).read_text()
    old = built.archive.with_name("operator-old.tar.cdx.json")
    old.write_text("{}")
    bills.of_image(built).unlink()

    assert bills.of_image(built).read_text() == first
    assert not old.exists()


def test_what_is_no_archive_is_refused_with_its_path(image):
    """Another program may have written a file at this path."""
    built = image()
    built.archive.write_text("no archive")

    with pytest.raises(ImagesError, match=r"operator-0123\.tar: is not a docker archive"):
        bills.of_image(built)


def test_a_bill_of_a_wheel_lists_what_it_was_tested_with(tmp_path):
    """The bill has the hashes of the lock file, so a person can install the tested packages."""
    sim, trainer, operator = bills.of_wheels(ROOT, tmp_path, "x86_64")

    assert f"pkg:pypi/palaestra-sim@{version('palaestra-sim')}" in listed(operator)
    assert any(url.startswith("pkg:pypi/stable-baselines3@") for url in listed(trainer))
    assert not any(url.startswith("pkg:pypi/pytest@") for url in (*listed(sim), *listed(operator)))
    hashes = [component.get("hashes") for component in json.loads(operator.read_text())["components"]]
    assert sum(each is None for each in hashes) == 1
