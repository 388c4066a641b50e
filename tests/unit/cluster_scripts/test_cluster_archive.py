"""The images for a cluster's node are archives that every container engine can load."""

import hashlib
import json
import tarfile
from pathlib import PurePosixPath

import pytest

from tests.cluster.archive import Image, write_archive


@pytest.fixture
def image(tmp_path):
    """Return an image with one program, a link to the program, and a library two folders deep."""
    program = tmp_path / "program"
    program.write_bytes(b"\x7fELF")
    library = tmp_path / "library"
    library.write_bytes(b"code")
    return Image(
        name="example.org/tools/program:v1",
        entrypoint="/bin/program",
        files={PurePosixPath("bin/program"): program, PurePosixPath("usr/lib/library.so"): library},
        links={PurePosixPath("bin/other"): "program"},
        user="65532:65532",
    )


def contents(path):
    """Return every file of an archive by its name."""
    with tarfile.open(path) as archive:
        return {member.name: archive.extractfile(member).read() for member in archive if member.isfile()}


def blob(files, descriptor):
    """Return the content to which a descriptor refers."""
    return files["blobs/sha256/" + descriptor["digest"].removeprefix("sha256:")]


def test_every_digest_is_that_of_the_content(image, tmp_path):
    """A container engine refuses an image whose digests are wrong."""
    write_archive(image, tmp_path / "image.tar")

    blobs = {name: data for name, data in contents(tmp_path / "image.tar").items() if "/sha256/" in name}
    assert len(blobs) == 3
    for name, data in blobs.items():
        assert name.rpartition("/")[2] == hashlib.sha256(data).hexdigest()


def test_the_descriptors_lead_from_the_index_to_the_layer(image, tmp_path):
    """A container engine follows these references, and refuses an image with a wrong digest or size."""
    write_archive(image, tmp_path / "image.tar")
    files = contents(tmp_path / "image.tar")

    entry = json.loads(files["index.json"])["manifests"][0]
    manifest = json.loads(blob(files, entry))
    configuration = json.loads(blob(files, manifest["config"]))

    assert entry["annotations"]["io.containerd.image.name"] == "example.org/tools/program:v1"
    assert configuration["config"]["Entrypoint"] == ["/bin/program"]
    assert configuration["config"]["User"] == "65532:65532"
    assert configuration["rootfs"]["diff_ids"] == [manifest["layers"][0]["digest"]]
    for descriptor in (entry, manifest["config"], manifest["layers"][0]):
        assert descriptor["size"] == len(blob(files, descriptor))


def test_the_layer_holds_files_links_and_each_folder_once(image, tmp_path):
    """Some container engines refuse a layer in which a folder is missing or occurs twice."""
    write_archive(image, tmp_path / "image.tar")
    files = contents(tmp_path / "image.tar")
    manifest = json.loads(blob(files, json.loads(files["index.json"])["manifests"][0]))
    layer_file = tmp_path / "layer.tar"
    layer_file.write_bytes(blob(files, manifest["layers"][0]))

    with tarfile.open(layer_file) as layer:
        names = layer.getnames()
        link = layer.getmember("bin/other")

    assert names == ["bin", "bin/other", "bin/program", "usr", "usr/lib", "usr/lib/library.so"]
    assert (link.issym(), link.linkname) == (True, "program")


def test_same_files_give_the_same_bytes(image, tmp_path):
    """The cache key of an archive comes from its content, so it must not contain times or owners."""
    write_archive(image, tmp_path / "first.tar")
    write_archive(image, tmp_path / "second.tar")

    assert (tmp_path / "first.tar").read_bytes() == (tmp_path / "second.tar").read_bytes()
