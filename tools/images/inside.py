"""The packages of Debian and of Python in an image, read from its archive.

The lock lists the requested packages, but only the archive shows the packages of the finished image. If a
later layer removes a package, the package is not in the image.
"""

import json
import re
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from email.parser import BytesHeaderParser, HeaderParser
from pathlib import Path

from tools.images.errors import ImagesError

_DPKG = re.compile(r"var/lib/dpkg/status(\.d/[^/]+)?")
# Debian's own modules for Python are excluded, because they are in the list of Debian's packages.
_METADATA = re.compile(r"(?!usr/lib/python3/dist-packages/).*\.dist-info/METADATA")
_REMOVED, _EMPTIED = ".wh.", ".wh..wh..opq"  # a layer's marks; source: the OCI image specification


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Package:
    """An installed package; `kind` is its type in a package URL, `deb` or `pypi`."""

    kind: str
    name: str
    version: str
    architecture: str | None = None


def packages(archive: Path) -> tuple[Package, ...]:
    """Return the packages in the image of a docker archive, sorted.

    Raises:
        ImagesError: the file is not a docker archive.
    """
    files: dict[str, bytes] = {}
    try:
        with tarfile.open(archive) as image:
            for layer in json.loads(_content(image, "manifest.json"))[0]["Layers"]:
                with tarfile.open(fileobj=image.extractfile(layer)) as changes:
                    _apply(changes, files)
    except (tarfile.TarError, KeyError, ValueError) as error:
        raise ImagesError(f"{archive}: is not a docker archive ({error})") from error
    return tuple(sorted({package for path, content in files.items() for package in _in(path, content)}))


def _content(archive: tarfile.TarFile, name: str) -> bytes:
    found = archive.extractfile(name)
    return found.read() if found is not None else b""


def _apply(layer: tarfile.TarFile, files: dict[str, bytes]) -> None:
    """Apply a layer's changes to `files`, which holds only the files with lists of packages."""
    for member in layer:
        path = member.name.removeprefix("./").removeprefix("/")
        folder, _, name = path.rpartition("/")
        if name == _EMPTIED:
            _remove(files, folder)
        elif name.startswith(_REMOVED):
            _remove(files, f"{folder}/{name.removeprefix(_REMOVED)}".removeprefix("/"))
        elif member.isfile() and (_DPKG.fullmatch(path) or _METADATA.fullmatch(path)):
            files[path] = _content(layer, member.name)


def _remove(files: dict[str, bytes], path: str) -> None:
    for gone in [name for name in files if name == path or name.startswith(f"{path}/")]:
        del files[gone]


def _in(path: str, content: bytes) -> Iterator[Package]:
    if _METADATA.fullmatch(path):
        head = BytesHeaderParser().parsebytes(content)
        yield Package(kind="pypi", name=re.sub(r"[-_.]+", "-", head["Name"]).lower(), version=head["Version"])
        return
    for stanza in content.decode().split("\n\n"):
        head = HeaderParser().parsestr(stanza)
        if head["Package"] and (head["Status"] or "installed").endswith(" installed"):
            yield Package(
                kind="deb", name=head["Package"], version=head["Version"], architecture=head["Architecture"]
            )
