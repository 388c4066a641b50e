"""The tar stream from a pod: all files arrive, and nothing is written outside the target folder."""

import io
import re
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

import palaestra.client.tar_stream
from palaestra.client.tar_extraction import MOST_HEAD_BYTES, WrongArchive, unpack
from palaestra.client.tar_stream import pack

WANTED = ("model.zip", "summary.json", "tensorboard")
PROGRAM = Path(palaestra.client.tar_stream.__file__).read_text()


def packed(folder, *names):
    """Return the tar stream in chunks; the packing program runs as in a container."""
    command = [sys.executable, "-I", "-c", PROGRAM, str(folder), *names]
    done = subprocess.run(command, capture_output=True, timeout=60, check=True)
    return iter([done.stdout[i : i + 1000] for i in range(0, len(done.stdout), 1000)])


def archive(*members):
    """Return the chunks of a tar archive with these members."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as tar:
        for member in members:
            hole = b"0\n".ljust(member.size, b"\0")  # the map of a sparse file that is one hole
            tar.addfile(member, io.BytesIO(hole if member.pax_headers else b"x" * member.size))
    return iter([file.getvalue()])


def test_files_and_folders_arrive_as_they_were(tmp_path):
    """Empty files, and files in subfolders, are copied too."""
    run, there = tmp_path / "run", tmp_path / "there"
    (run / "tensorboard" / "deep").mkdir(parents=True)
    there.mkdir()
    (run / "model.zip").write_bytes(bytes(range(256)) * 100)
    (run / "tensorboard" / "deep" / "events").write_bytes(b"")
    (run / "secret").write_text("not asked for")

    unpack(packed(run, "model.zip", "tensorboard", "missing"), there, WANTED, 10**6)

    found = {str(each.relative_to(there)): each.read_bytes() for each in there.rglob("*") if each.is_file()}
    assert found == {"model.zip": bytes(range(256)) * 100, "tensorboard/deep/events": b""}


def test_a_folder_that_is_not_there_is_an_empty_archive(tmp_path):
    """A run that has not written a file yet must not make `fetch` fail."""
    unpack(packed(tmp_path / "none", "model.zip"), tmp_path, WANTED, 10**6)

    assert list(tmp_path.iterdir()) == []


def test_only_named_files_and_folders_are_packed_in_a_fixed_order(tmp_path, capfdbinary):
    """The run writes files while they are packed, and a file that was not requested may be large."""
    (tmp_path / "tensorboard" / "deep").mkdir(parents=True)
    for name in ("secret", "model.zip", "tensorboard/b", "tensorboard/a", "tensorboard/deep/c"):
        (tmp_path / name).write_text(name)

    pack(str(tmp_path), ["tensorboard", "model.zip", "missing"])

    with tarfile.open(fileobj=io.BytesIO(capfdbinary.readouterr().out)) as tar:
        found = {each.name: tar.extractfile(each).read().decode() for each in tar}
    assert list(found) == ["tensorboard/a", "tensorboard/b", "tensorboard/deep/c", "model.zip"]
    assert list(found.values()) == list(found)


def member(name, size=1, kind=tarfile.REGTYPE, **words):
    """Return the header of a member of a tar archive."""
    made = tarfile.TarInfo(name)
    made.size, made.type = size, kind
    for word, value in words.items():
        setattr(made, word, value)
    return made


SPARSE = {
    "GNU.sparse.major": "1",
    "GNU.sparse.minor": "0",
    "GNU.sparse.name": "model.zip",
    "GNU.sparse.realsize": str(3 << 30),
}
HOSTILE = {
    "outside": ([member("../outside")], "../outside is not a file of the run"),
    "absolute": ([member("/outside")], "/outside is not a file of the run"),
    "back and out": ([member("tensorboard/../../outside")], "outside is not a file of the run"),
    "not asked for": ([member(".bashrc")], ".bashrc is not a file of the run"),
    "below a file that was asked for": (
        [member("model.zip"), member("model.zip/x")],
        "occurs twice, or is",
    ),
    "a folder of a file": ([member("tensorboard/a/b"), member("tensorboard/a")], "occurs twice, or is"),
    "twice": ([member("model.zip"), member("model.zip")], "model.zip occurs twice"),
    "without a name": ([member("")], "a member without a name is not a file of the run"),
    "escape sequences": ([member("tensorboard/\x1b[2J")], "tensorboard/ [2J is not a file of the run"),
    "deep": ([member("tensorboard/" + "d/" * 20 + "e")], "has a name that is too long"),
    "link": ([member("model.zip", 0, tarfile.SYMTYPE, linkname="/etc/passwd")], "model.zip is not a regular"),
    "hard link": ([member("model.zip", 0, tarfile.LNKTYPE, linkname="/etc/passwd")], "is not a regular file"),
    "pipe": ([member("model.zip", 0, tarfile.FIFOTYPE)], "model.zip is not a regular file"),
    "device": ([member("model.zip", 0, tarfile.CHRTYPE)], "model.zip is not a regular file"),
    "a few bytes that are 3 GiB": ([member("model.zip", 512, pax_headers=SPARSE)], "is not a regular file"),
    "too large": ([member("model.zip", 700), member("summary.json", 400)], "have more than 1000 bytes"),
}


@pytest.mark.parametrize(("members", "fact"), HOSTILE.values(), ids=HOSTILE)
def test_what_was_not_asked_for_is_refused(tmp_path, members, fact):
    """The job's author chooses the image that sends the archive, so the client does not trust it."""
    inside = tmp_path / "inside"
    inside.mkdir()

    with pytest.raises(WrongArchive, match=re.escape(fact)):
        unpack(archive(*members), inside, WANTED, 1000)
    assert [path for path in tmp_path.rglob("*") if not path.is_relative_to(inside)] == []


def header(kind, size):
    """Return the first block of a member whose data describes the next member."""
    return member("././@PaxHeader", size, kind).tobuf(tarfile.GNU_FORMAT)


ENDLESS = {
    "an extended header of 300 MiB": header(tarfile.XHDTYPE, 300 << 20),
    "a name of 300 MiB": header(tarfile.GNUTYPE_LONGNAME, 300 << 20),
    "a file of 8 GiB": member("model.zip", 8 << 30).tobuf(tarfile.GNU_FORMAT),
}


@pytest.mark.parametrize("begun", ENDLESS.values(), ids=ENDLESS)
def test_an_endless_member_is_not_kept_in_memory(tmp_path, begun):
    """The reader stops at its size limits, so the pod cannot fill the client's memory."""
    sent = []

    def chunks():
        yield begun
        while True:
            sent.append(2**16)
            yield b"\0" * 2**16

    with pytest.raises(WrongArchive):
        unpack(chunks(), tmp_path, WANTED, 2**30)
    assert sum(sent) <= 4 * MOST_HEAD_BYTES


def test_files_without_end_are_refused(tmp_path, monkeypatch):
    """Even empty files use inodes of the client's disk, so their number is limited."""
    monkeypatch.setattr("palaestra.client.tar_extraction.MOST_FILES", 3)
    empty = [member(f"tensorboard/{number}", 0) for number in range(4)]

    with pytest.raises(WrongArchive, match="it has more than 3 files"):
        unpack(archive(*empty), tmp_path, WANTED, 1000)


@pytest.mark.parametrize("sent", [b"x" * 2000, bytes(range(256)) * 8], ids=["letters", "bytes"])
def test_what_is_no_tar_is_damaged(tmp_path, sent):
    """A proxy may send an error page instead of the pod's data."""
    with pytest.raises(WrongArchive, match="is damaged"):
        unpack(iter([sent]), tmp_path, WANTED, 1000)


def test_what_was_cut_off_is_no_archive(tmp_path):
    """A user must not take a truncated archive for a complete run."""
    [whole] = archive(member("model.zip", 5000))

    with pytest.raises(WrongArchive, match="is damaged"):
        unpack(iter([whole[:1000]]), tmp_path, WANTED, 10_000)


def test_the_word_at_the_end_is_waited_for(tmp_path):
    """The tar archive ends before the command in the pod does.

    The exit code comes last and may be an error.
    """

    def chunks():
        yield from archive(member("model.zip", 0))
        raise RuntimeError("exit code 1")

    with pytest.raises(RuntimeError, match="exit code 1"):
        unpack(chunks(), tmp_path, WANTED, 1000)
