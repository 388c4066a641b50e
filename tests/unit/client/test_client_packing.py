"""What runs in the container, and what unpacks it here: all of it arrives, and nothing lands elsewhere."""

import io
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

import palaestra.client.packing
from palaestra.client.fetching import unpack

PROGRAM = Path(palaestra.client.packing.__file__).read_text()


def packed(folder, *names):
    """Return the chunks that the program writes, run as a container runs it."""
    command = [sys.executable, "-I", "-c", PROGRAM, str(folder), *names]
    done = subprocess.run(command, capture_output=True, timeout=60, check=True)
    return iter([done.stdout[i : i + 1000] for i in range(0, len(done.stdout), 1000)])


def archive(*members):
    """Return the chunks of a tar with these members."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as tar:
        for member in members:
            tar.addfile(member, io.BytesIO(b"x" * member.size))
    return iter([file.getvalue()])


def test_files_and_folders_arrive_as_they_were(tmp_path):
    """Also empty ones, and those below a folder."""
    run, there = tmp_path / "run", tmp_path / "there"
    (run / "tensorboard" / "deep").mkdir(parents=True)
    there.mkdir()
    (run / "model.zip").write_bytes(bytes(range(256)) * 100)
    (run / "tensorboard" / "deep" / "events").write_bytes(b"")
    (run / "secret").write_text("not asked for")

    unpack(packed(run, "model.zip", "tensorboard", "missing"), there)

    found = {str(each.relative_to(there)): each.read_bytes() for each in there.rglob("*") if each.is_file()}
    assert found == {"model.zip": bytes(range(256)) * 100, "tensorboard/deep/events": b""}


def test_a_folder_that_is_not_there_is_an_empty_archive(tmp_path):
    """A run that has written nothing yet is no failure of the program."""
    unpack(packed(tmp_path / "none", "model.zip"), tmp_path)

    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["../outside", "/outside", "inside/../../outside"])
def test_a_member_that_would_land_elsewhere_is_refused(tmp_path, name):
    """The image is the job's author's: its word is not trusted."""
    inside = tmp_path / "inside"
    inside.mkdir()
    member = tarfile.TarInfo(name)
    member.size = 1

    with pytest.raises(tarfile.TarError, match="outside is not a file of the run"):
        unpack(archive(member), inside)
    assert list(tmp_path.rglob("*")) == [inside]


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE])
def test_what_is_no_file_is_refused(tmp_path, kind):
    """A later file that is written through a link would land outside the folder."""
    member = tarfile.TarInfo("link")
    member.type, member.linkname = kind, "/etc/passwd"

    with pytest.raises(tarfile.TarError, match="link is not a file"):
        unpack(archive(member), tmp_path)


def test_what_was_cut_off_is_no_archive(tmp_path):
    """A connection that ends early must not look like a short run."""
    member = tarfile.TarInfo("model.zip")
    member.size = 5000
    [whole] = archive(member)

    with pytest.raises(tarfile.TarError):
        unpack(iter([whole[:1000]]), tmp_path)


def test_the_word_at_the_end_is_waited_for(tmp_path):
    """A tar ends before its command does: the exit code comes last."""

    def chunks():
        yield from archive(tarfile.TarInfo("a"))
        raise RuntimeError("exit code 1")

    with pytest.raises(RuntimeError, match="exit code 1"):
        unpack(chunks(), tmp_path)
