"""Unpack an untrusted tar stream from a container.

The module writes only requested regular files, below one folder. It limits the number of files, their total
size, the length of their names and the memory in use.
"""

import io
import shutil
import tarfile
from collections.abc import Collection, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from palaestra.api.text import one_line

MOST_FILES = 10_000
MOST_PARTS = 16
MOST_NAME_BYTES = 255
# Limit in bytes of the data between the contents of two files. This data is headers, and blocks that are read
# ahead.
MOST_HEAD_BYTES = 2**16


class WrongArchive(tarfile.TarError):
    """A tar stream is damaged, or contains a file that was not requested; the message is for people."""


def unpack(chunks: Iterator[bytes], into: Path, wanted: Collection[str], most_bytes: int) -> None:
    """Write the files of a tar stream into a new folder, and read the stream to its end.

    Args:
        chunks: consecutive pieces of the stream's bytes, of any size.
        into: the new folder.
        wanted: names of the requested files and folders.
        most_bytes: the greatest size of all files together, in bytes.

    Raises:
        WrongArchive: the stream is not a tar, has members that were not requested, or is too large.
        OSError: a file cannot be written.
    """
    stream = _Stream(chunks)
    seen = _Seen()
    left = most_bytes
    try:
        with tarfile.open(fileobj=stream, mode="r|") as tar:
            for member in tar:
                path = _path(member, wanted, seen)
                seen.add(path)
                left -= member.size
                _refuse(f"its files have more than {most_bytes} bytes together", when=left < 0)
                stream.left = member.size + MOST_HEAD_BYTES
                _write(tar, member, into / path)
    except WrongArchive:
        raise
    except (tarfile.TarError, ValueError, UnicodeError) as error:  # tarfile raises all three
        raise WrongArchive(f"the archive from the pod is damaged ({one_line(str(error), 200)})") from error
    for _ in chunks:  # Read the stream to its end, where the command's exit code is.
        pass


class _Seen:
    """The files that were read from an archive, and their folders."""

    def __init__(self) -> None:
        self.files: set[PurePosixPath] = set()
        self._folders: set[PurePosixPath] = set()

    def add(self, path: PurePosixPath) -> None:
        self.files.add(path)
        self._folders.update(path.parents)

    def clashes_with(self, path: PurePosixPath) -> bool:
        """Return whether the path conflicts with an earlier file or folder."""
        return path in self.files or path in self._folders or not self.files.isdisjoint(path.parents)


def _path(member: tarfile.TarInfo, wanted: Collection[str], seen: _Seen) -> PurePosixPath:
    """Return the path of a member that may be written.

    Raises:
        WrongArchive: the member must not be written.
    """
    name, path = member.name, PurePosixPath(member.name)
    shown = one_line(name, 100) or "a member without a name"
    asked_for = bool(path.parts) and (name in wanted or path.parts[0] in wanted) and ".." not in path.parts
    _refuse(f"{shown} is not a file of the run", when=not (asked_for and name.isprintable()))
    _refuse(f"{shown} is not a regular file", when=not member.isreg() or member.issparse())
    long = len(path.parts) > MOST_PARTS or any(len(part.encode()) > MOST_NAME_BYTES for part in path.parts)
    _refuse(f"{shown} has a name that is too long", when=long)
    _refuse(f"{shown} occurs twice, or is a file and a folder", when=seen.clashes_with(path))
    _refuse(f"it has more than {MOST_FILES} files", when=len(seen.files) >= MOST_FILES)
    return path


def _refuse(fact: str, *, when: bool) -> None:
    if when:
        raise WrongArchive(fact)


def _write(tar: tarfile.TarFile, member: tarfile.TarInfo, path: Path) -> None:
    content = tar.extractfile(member)
    if content is None:
        raise AssertionError("unreachable: a regular file has content")
    path.parent.mkdir(parents=True, exist_ok=True)
    with content, path.open("xb") as target:
        shutil.copyfileobj(content, target)


class _Stream(io.RawIOBase):
    """An iterator of chunks as a readable file.

    Attributes:
        left: number of bytes that may be read until the next member is known. The limit is for headers,
            because tarfile keeps a whole header in memory.
    """

    def __init__(self, chunks: Iterator[bytes]) -> None:
        self._chunks = chunks
        self._rest = b""
        self.left = MOST_HEAD_BYTES

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Copy received bytes into the buffer and return their number; 0 at the end.

        Raises:
            WrongArchive: more bytes are between two files than `left` allows.
        """
        while not self._rest:
            try:
                self._rest = next(self._chunks)
            except StopIteration:
                return 0
        size = min(len(buffer), len(self._rest))
        self.left -= size
        if self.left < 0:
            raise WrongArchive(f"a header has more than {MOST_HEAD_BYTES} bytes")
        buffer[:size], self._rest = self._rest[:size], self._rest[size:]
        return size
