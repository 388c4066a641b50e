"""The policy package: a folder with a policy, and a manifest that describes its files.

A reader checks the whole package before it uses a file of it, because a policy with other observations,
another rate or damaged weights moves a robot in a wrong way.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, cast

from palaestra_protocol.fields import MOST_COUNT, MOST_NAME, Fields, ProtocolError, decoded

MANIFEST: Final = "manifest.json"
FORMAT: Final = 1
MODEL: Final = "model.zip"
NETWORK: Final = "policy.onnx"
TRAINING: Final = "training.yaml"

MOST_MANIFEST_BYTES: Final = 2**22
MOST_FILES: Final = 64

_DIGEST: Final = re.compile(r"[0-9a-f]{64}")
_FILE_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")


class PackageError(ProtocolError):
    """A folder is not a policy package, or a file of the package is not the one that was exported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PackageFile:
    """A file of a package, as the manifest describes it.

    Attributes:
        name: its name in the folder.
        size: its bytes.
        sha256: the SHA-256 of its content, as 64 hexadecimal digits.
    """

    name: str
    size: int
    sha256: str

    @classmethod
    def of(cls, name: str, content: bytes) -> PackageFile:
        """Return the description of a content."""
        return cls(name=name, size=len(content), sha256=hashlib.sha256(content).hexdigest())

    @classmethod
    def read(cls, content: object, path: str) -> PackageFile:
        """Return the description in an entry of a manifest.

        Raises:
            ProtocolError: the entry is not one, or its name is a path.
        """
        fields = Fields(content, path)
        name, sha256 = fields.text("name", MOST_NAME), fields.text("sha256")
        if not _FILE_NAME.fullmatch(name):
            raise ProtocolError(f"{path}.name: {name[:40]!r} is not the name of a file in the package")
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


def read_package(folder: Path, *needed: str) -> dict[str, Any]:
    """Return the manifest of the package in a folder, after a check of every file.

    Args:
        folder: the folder.
        needed: the names of the files that the caller uses.

    Raises:
        PackageError: the folder has no manifest, the manifest has another format or lacks a needed file, or a
            file is missing or has changed.
    """
    manifest = folder / MANIFEST
    try:
        with manifest.open("rb") as file:
            text = file.read(MOST_MANIFEST_BYTES + 1)
    except OSError as error:
        raise PackageError(f"{manifest}: {error.strerror}; name a folder of `palaestra export`") from error
    try:
        content, files = _parsed(text)
    except ProtocolError as error:
        raise PackageError(f"{manifest}: {error}; export the package again") from error
    if lacking := sorted(set(needed) - {each.name for each in files}):
        raise PackageError(f"{manifest}: does not list {lacking[0]}; export the package again")
    for each in files:
        _check(folder / each.name, each)
    return content


def _parsed(text: bytes) -> tuple[dict[str, Any], tuple[PackageFile, ...]]:
    """Return the fields of a manifest, and the descriptions of its files."""
    content = decoded(text, MOST_MANIFEST_BYTES)
    fields = Fields(content)
    if (found := fields.whole("format")) != FORMAT:
        raise ProtocolError(f"format: is {found}, but this release reads {FORMAT}")
    return cast("dict[str, Any]", content), fields.parts("files", PackageFile.read, MOST_FILES)


def _check(path: Path, described: PackageFile) -> None:
    """Raise PackageError unless a file has the described size and digest."""
    try:
        with path.open("rb") as file:
            same = path.stat().st_size == described.size
            same = same and hashlib.file_digest(file, "sha256").hexdigest() == described.sha256
    except OSError as error:
        raise PackageError(f"{path}: {error.strerror}; copy the whole package") from error
    if not same:
        raise PackageError(f"{path}: is not the file that was exported; copy the whole package again")
