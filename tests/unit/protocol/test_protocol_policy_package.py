"""A policy package is used only if each file is the one that was exported."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.policy_package import MANIFEST, PackageError, manifest_text, read_package

FILES = {"policy.onnx": b"network" * 1000, "model.zip": b"", "job.yaml": b"kind: TrainingJob\n"}


@pytest.fixture
def folder(tmp_path):
    """Return a folder with a package."""
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / MANIFEST).write_bytes(manifest_text({"job": "tiny"}, FILES))
    return tmp_path


def test_a_whole_package_is_described_by_its_manifest(folder):
    """The reader accepts other files in the folder, such as notes."""
    (folder / "notes.txt").write_text("drives well")

    content = read_package(folder)

    assert content["job"] == "tiny"
    assert [each["name"] for each in content["files"]] == sorted(FILES)


@given(at=st.integers(0, len(FILES["policy.onnx"]) - 1), bit=st.integers(0, 7))
def test_a_file_with_one_other_bit_is_refused(tmp_path_factory, at, bit):
    """One wrong weight can be the difference between a stop and a collision."""
    folder = tmp_path_factory.mktemp("package")
    damaged = bytearray(FILES["policy.onnx"])
    damaged[at] ^= 1 << bit
    (folder / "policy.onnx").write_bytes(damaged)
    (folder / MANIFEST).write_bytes(manifest_text({}, {"policy.onnx": FILES["policy.onnx"]}))

    with pytest.raises(PackageError, match=r"policy\.onnx: is not the file that was exported; copy"):
        read_package(folder)


@pytest.mark.parametrize("content", [b"", b"network" * 999, b"network" * 1001])
def test_a_file_of_another_length_is_refused(folder, content):
    """A copy that was interrupted has the right beginning."""
    (folder / "policy.onnx").write_bytes(content)

    with pytest.raises(PackageError, match="is not the file that was exported"):
        read_package(folder)


def test_a_missing_file_is_named(folder):
    """The message must name the file, so that a person can copy it."""
    (folder / "model.zip").unlink()

    with pytest.raises(PackageError, match=r"model\.zip: No such file or directory; copy the whole package"):
        read_package(folder)


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        (b"{", "body: is not JSON"),
        (b"[]", "body: a list is not an object"),
        (b"{}", "format: is missing"),
        (b'{"format": 2, "files": []}', "format: is 2, but this release reads 1"),
        (b'{"format": 1}', "files: is missing"),
        (b" " * (2**22 + 1), "bytes are more than"),
    ],
)
def test_a_wrong_manifest_is_refused(tmp_path, text, fact):
    """A reader of another format would mistake one field for another."""
    (tmp_path / MANIFEST).write_bytes(text)

    with pytest.raises(PackageError, match=f"{fact}.*; export the package again"):
        read_package(tmp_path)


@pytest.mark.parametrize("name", ["../model.zip", "/etc/passwd", ".hidden", "a/b", "", "a\\b"])
def test_a_name_outside_of_the_folder_is_refused(tmp_path, name):
    """A package of another person must not make a reader open other files."""
    content = json.loads(manifest_text({}, {"a": b""}))
    content["files"][0]["name"] = name
    (tmp_path / MANIFEST).write_text(json.dumps(content))

    with pytest.raises(PackageError, match="is not the name of a file; use letters"):
        read_package(tmp_path)


def test_a_folder_without_a_manifest_is_no_package(tmp_path):
    """The message must say how a package is made."""
    with pytest.raises(
        PackageError, match=r"No such file or directory; name a folder or a zip of `palaestra export`"
    ):
        read_package(tmp_path)


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"sha256": "0" * 63}, r"files\[0\]\.sha256: is not a SHA-256"),
        ({"sha256": "G" * 64}, r"files\[0\]\.sha256: is not a SHA-256"),
        ({"size": 2**31 + 1}, "files: have 2147483649 bytes, more than the 2147483648 of a package"),
    ],
)
def test_a_description_that_no_file_can_have_is_refused_before_a_file_is_read(tmp_path, changes, fact):
    """The message blames the manifest; without the check it would blame the file, which may be right."""
    content = json.loads(manifest_text({}, {"a": b""}))
    content["files"][0] |= changes
    (tmp_path / MANIFEST).write_text(json.dumps(content))

    with pytest.raises(PackageError, match=f"{fact}; export the package again"):
        read_package(tmp_path)
