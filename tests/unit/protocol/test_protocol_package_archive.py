"""A package as a zip is refused as a whole if any part of it could harm a reader."""

import stat
import zipfile

import pytest

from palaestra_protocol.package_archive import archived
from palaestra_protocol.policy_package import (
    MANIFEST,
    PackageError,
    is_package,
    manifest_text,
    read_files,
    read_package,
)

FILES = {"policy.onnx": b"network" * 1000, "model.zip": b"", "job.yaml": b"kind: TrainingJob\n"}
WHOLE = FILES | {MANIFEST: manifest_text({"job": "tiny"}, FILES)}


def zipped(path, members, **options):
    """Write a zip with these contents by names or descriptions, and return its path."""
    with zipfile.ZipFile(path, "w", **options) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return path


def link(name):
    """Return the description of a symbolic link in a zip."""
    member = zipfile.ZipInfo(name)
    member.external_attr = (stat.S_IFLNK | 0o777) << 16
    return member


def test_the_contents_are_those_that_were_written(tmp_path):
    """A person may also have made the zip with a program that compresses files."""
    ours, theirs = tmp_path / "ours.zip", tmp_path / "theirs.zip"
    ours.write_bytes(archived(WHOLE))
    zipped(theirs, WHOLE.items(), compression=zipfile.ZIP_DEFLATED)

    for place in (ours, theirs):
        manifest, contents = read_files(place, "policy.onnx")

        assert is_package(place)
        assert manifest["job"] == "tiny"
        assert contents == {"policy.onnx": FILES["policy.onnx"]}


def test_equal_files_make_equal_bytes():
    """A person who compares two packages compares their checksums."""
    assert archived(WHOLE) == archived(dict(reversed(WHOLE.items())))


@pytest.mark.parametrize(
    ("members", "fact"),
    [
        ([*WHOLE.items(), ("../model.zip", b"")], r"has '\.\./model\.zip', which is not the name of a file"),
        ([*WHOLE.items(), ("/etc/passwd", b"")], "which is not the name of a file"),
        ([*WHOLE.items(), ("folder/", b"")], "which is not the name of a file"),
        ([*WHOLE.items(), (link("notes.txt"), b"/etc/passwd")], r"has notes\.txt, which is not a plain file"),
        ([*WHOLE.items(), *((f"note{each}", b"") for each in range(128))], "has more than 128 files"),
        ([(name, content) for name, content in WHOLE.items() if name != MANIFEST], r"has no manifest\.json"),
        ([(name, content) for name, content in WHOLE.items() if name != "model.zip"], r"has no model\.zip"),
        ([*FILES.items(), (MANIFEST, b" " * (2**22 + 2**30 // 256))], "bytes are more than"),
    ],
)
def test_an_archive_that_is_no_package_is_refused(tmp_path, members, fact):
    """A malicious archive could write files outside the target folder, or fill the memory."""
    place = zipped(tmp_path / "package.zip", members, compression=zipfile.ZIP_DEFLATED)

    with pytest.raises(PackageError, match=fact):
        read_package(place)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_name_that_stands_twice_is_refused(tmp_path):
    """Two programs could read two different policies in one archive."""
    place = zipped(tmp_path / "package.zip", [*WHOLE.items(), ("policy.onnx", b"another")])

    with pytest.raises(PackageError, match=r"has policy\.onnx twice"):
        read_package(place)


@pytest.mark.parametrize("damage", ["end", "middle", "text", "all"])
def test_a_damaged_archive_is_refused(tmp_path, damage):
    """A copy over a bad network lacks its end, or has other bytes."""
    place = tmp_path / "package.zip"
    content = archived(WHOLE)
    middle = content.index(b"networknetwork")
    place.write_bytes(
        {
            "end": content[:-30],
            "middle": content[:middle] + b"N" + content[middle + 1 :],
            "text": b"drives well",
            "all": b"",
        }[damage]
    )

    with pytest.raises(PackageError, match=r"is not a zip of a package|cannot be unpacked"):
        read_package(place)


def test_a_missing_file_is_no_package(tmp_path):
    """The message must say how a package is made."""
    with pytest.raises(
        PackageError, match=r"No such file or directory; name a package of `palaestra export`"
    ):
        read_package(tmp_path / "package.zip")


def test_an_archive_with_64_bit_numbers_is_refused_before_its_list_is_read(tmp_path):
    """The size of such a list is in another record, and a malicious record may name any size."""
    content = archived(WHOLE)
    place = tmp_path / "package.zip"
    place.write_bytes(content[:-22] + b"PK\x06\x07" + bytes(16) + content[-22:])

    with pytest.raises(PackageError, match="is a zip of more than 4 GiB or 65,535 files; export the package"):
        read_package(place)


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_compression_that_not_every_python_has_is_refused(tmp_path, compression):
    """A robot's Python may lack bz2 and lzma, so a package that one reader accepts suits all readers."""
    place = zipped(tmp_path / "package.zip", WHOLE.items(), compression=compression)

    with pytest.raises(PackageError, match="compressed in another way than by deflate"):
        read_package(place)


def test_an_archive_whose_list_is_damaged_is_refused(tmp_path):
    """The end of the file is whole, so only the reader of the list finds the damage."""
    content = archived(WHOLE)
    first = content.index(b"PK\x01\x02")
    place = tmp_path / "package.zip"
    place.write_bytes(content[:first] + b"PK\x00\x00" + content[first + 4 :])

    with pytest.raises(PackageError, match=r"is not a zip of a package \(Bad magic number"):
        read_package(place)
