"""The policy package: a folder or a zip with a policy, and a manifest that describes its files.

A reader checks the whole package before it uses a file of it, because a policy with other observations,
another rate or damaged weights moves a robot in a wrong way.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any, Final, Protocol, cast

from palaestra_protocol.fields import MOST_COUNT, MOST_NAME, Fields, ProtocolError, decoded
from palaestra_protocol.package_archive import FILE_NAME, MEMBER_ERRORS, has_member, opened

MANIFEST: Final = "manifest.json"
FORMAT: Final = 1
MODEL: Final = "model.zip"
NETWORK: Final = "policy.onnx"
TRAINING: Final = "training.yaml"

MOST_MANIFEST_BYTES: Final = 2**22
MOST_FILES: Final = 64
MOST_PACKAGE_BYTES: Final = 2**31

_DIGEST: Final = re.compile(r"[0-9a-f]{64}")
_PIECE_BYTES: Final = 2**20
_NO_PACKAGE: Final = "name a folder or a zip of `palaestra export`"
_INCOMPLETE: Final = "copy the whole package"


class PackageError(ProtocolError):
    """A place is not a policy package, or a file of the package is not the one that was exported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PackageFile:
    """A file of a package, as the manifest describes it.

    Attributes:
        name: its name in the folder.
        size: the number of its bytes.
        sha256: the SHA-256 of its content, as 64 hexadecimal digits.
    """

    name: str
    size: int
    sha256: str

    @classmethod
    def of(cls, name: str, content: bytes) -> PackageFile:
        """Return the description of a file with this name and content."""
        return cls(name=name, size=len(content), sha256=hashlib.sha256(content).hexdigest())

    @classmethod
    def read(cls, content: object, path: str) -> PackageFile:
        """Return the description in an entry of a manifest.

        Raises:
            ProtocolError: the entry does not describe a file, or its name is a path.
        """
        fields = Fields(content, path)
        name, sha256 = fields.text("name", MOST_NAME), fields.text("sha256")
        if not FILE_NAME.fullmatch(name):
            raise ProtocolError(
                f"{path}.name: {name[:40]!r} is not the name of a file; use letters, digits, _, . and -"
            )
        if not _DIGEST.fullmatch(sha256):
            raise ProtocolError(f"{path}.sha256: is not a SHA-256")
        return cls(name=name, size=fields.whole("size", 0, MOST_COUNT), sha256=sha256)


def manifest_text(description: Mapping[str, Any], files: Mapping[str, bytes]) -> bytes:
    """Return the manifest of a package with these files.

    Args:
        description: the fields of the manifest, except `format` and `files`.
        files: the contents, by file name.
    """
    entries = [asdict(PackageFile.of(name, content)) for name, content in sorted(files.items())]
    content = {"format": FORMAT, **description, "files": entries}
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


def read_package(place: Path, *needed: str) -> dict[str, Any]:
    """Return the manifest of a package, after a check of every file.

    Args:
        place: the folder or the zip of the package.
        needed: the names of the files that the caller uses.

    Raises:
        PackageError: the place has no manifest, the manifest has another format or lacks a needed file, or a
            file is missing or has changed.
    """
    return _read(place, needed, frozenset())[0]


def read_files(place: Path, *needed: str) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Return the manifest of a package, and the contents of the needed files, after a check of every file.

    The returned contents are the checked contents, even if another program replaces the files meanwhile.

    Raises:
        PackageError: see `read_package`.
    """
    return _read(place, needed, frozenset(needed))


def is_package(place: Path) -> bool:
    """Return whether a folder or a zip has a manifest; its files are not checked."""
    return (place / MANIFEST).is_file() if place.is_dir() else has_member(place, MANIFEST)


class _Files(Protocol):
    def open(self, name: str) -> IO[bytes]:
        """Open a file of the package for reading; raise OSError or KeyError if the package lacks the file."""
        ...


class _Folder:
    def __init__(self, path: Path) -> None:
        self._path = path

    def open(self, name: str) -> IO[bytes]:
        """Open a file of the folder."""
        return (self._path / name).open("rb")


@contextmanager
def _opened(place: Path) -> Iterator[_Files]:
    if place.is_dir():
        yield _Folder(place)
        return
    try:
        with opened(place) as archive:
            yield archive
    except OSError as error:
        raise PackageError(f"{place}: {error.strerror}; name a package of `palaestra export`") from error
    except PackageError:
        raise
    except ProtocolError as error:
        raise PackageError(f"{place}: {error}; export the package again") from error


def _read(
    place: Path, needed: Sequence[str], kept: AbstractSet[str]
) -> tuple[dict[str, Any], dict[str, bytes]]:
    with _opened(place) as files:
        manifest = place / MANIFEST
        text = b"".join(_pieces(files, place, MANIFEST, MOST_MANIFEST_BYTES + 1, _NO_PACKAGE))
        try:
            content, described = _parsed(text)
        except ProtocolError as error:
            raise PackageError(f"{manifest}: {error}; export the package again") from error
        if lacking := sorted(set(needed) - {each.name for each in described}):
            raise PackageError(f"{manifest}: does not list {lacking[0]}; export the package again")
        contents = {each.name: _checked(files, place, each, keep=each.name in kept) for each in described}
        return content, {name: contents[name] for name in kept}


def _parsed(text: bytes) -> tuple[dict[str, Any], tuple[PackageFile, ...]]:
    """Return the fields of a manifest, and the descriptions of its files."""
    content = decoded(text, MOST_MANIFEST_BYTES)
    fields = Fields(content)
    if (found := fields.whole("format")) != FORMAT:
        raise ProtocolError(f"format: is {found}, but this release reads {FORMAT}")
    files = fields.parts("files", PackageFile.read, MOST_FILES)
    if (total := sum(each.size for each in files)) > MOST_PACKAGE_BYTES:
        raise ProtocolError(f"files: have {total} bytes, more than the {MOST_PACKAGE_BYTES} of a package")
    return cast("dict[str, Any]", content), files


def _checked(files: _Files, place: Path, described: PackageFile, *, keep: bool) -> bytes:
    """Check the size and the digest of a file; return its content, or b"" if `keep` is false.

    Raises:
        PackageError: the file is missing or has changed.
    """
    digest, size, kept = hashlib.sha256(), 0, list[bytes]()
    for piece in _pieces(files, place, described.name, described.size + 1, _INCOMPLETE):
        digest.update(piece)
        size += len(piece)
        if keep:
            kept.append(piece)
    if size != described.size or digest.hexdigest() != described.sha256:
        raise PackageError(
            f"{place / described.name}: is not the file that was exported; {_INCOMPLETE} again"
        )
    return b"".join(kept)


def _pieces(files: _Files, place: Path, name: str, most_bytes: int, remedy: str) -> Iterator[bytes]:
    """Yield at most `most_bytes` bytes of a file in pieces.

    Raises:
        PackageError: the file cannot be read; the message ends with the remedy.
    """
    left = most_bytes
    try:
        with files.open(name) as file:
            while left > 0 and (piece := file.read(min(left, _PIECE_BYTES))):
                left -= len(piece)
                yield piece
    except OSError as error:
        raise PackageError(f"{place / name}: {error.strerror}; {remedy}") from error
    except KeyError as error:
        raise PackageError(f"{place}: has no {name}; {remedy}") from error
    except MEMBER_ERRORS as error:
        raise PackageError(f"{place / name}: cannot be unpacked ({error}); {remedy}") from error
