"""Write container images as OCI archives from plain files, without a container engine.

An image has one layer, which contains programs and their dependencies. The same files give the same bytes,
because the archive contains no times and owners. So an archive can be cached under a hash of its content.
"""

from __future__ import annotations

import hashlib
import io
import json
import tarfile
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path, PurePosixPath

MEDIA_TYPE = "application/vnd.oci.image."
SEARCH_PATH = "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


@dataclass(frozen=True, slots=True, kw_only=True)
class Image:
    """An image: full name with tag, program to start, files and links by path, and user and group."""

    name: str
    entrypoint: str
    files: Mapping[PurePosixPath, Path]
    links: Mapping[PurePosixPath, str] = field(default_factory=dict)
    user: str = "0:0"


def write_archive(image: Image, target: Path) -> None:
    """Write the image to `target` as an OCI archive that containerd imports under the image's full name."""
    layer = _layer(image)
    configuration = _json(
        {
            "architecture": "amd64",
            "os": "linux",
            "config": {"Env": [SEARCH_PATH], "Entrypoint": [image.entrypoint], "User": image.user},
            "rootfs": {"type": "layers", "diff_ids": [_digest(layer)]},
        },
    )
    manifest = _json(
        {
            "schemaVersion": 2,
            "mediaType": MEDIA_TYPE + "manifest.v1+json",
            "config": _descriptor("config.v1+json", configuration),
            "layers": [_descriptor("layer.v1.tar", layer)],
        },
    )
    index = _json({"schemaVersion": 2, "manifests": [_entry(image.name, manifest)]})
    part = target.with_name(target.name + ".part")
    with tarfile.open(part, "w") as archive:
        _add(archive, "oci-layout", _json({"imageLayoutVersion": "1.0.0"}))
        _add(archive, "index.json", index)
        for blob in (layer, configuration, manifest):
            _add(archive, "blobs/sha256/" + _digest(blob).removeprefix("sha256:"), blob)
    part.replace(target)


def _layer(image: Image) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as layer:
        folders: set[PurePosixPath] = set()
        for place in sorted({*image.files, *image.links}):
            for folder in reversed(place.parents[:-1]):
                if folder not in folders:
                    folders.add(folder)
                    layer.addfile(_member(str(folder), tarfile.DIRTYPE))
            if place in image.links:
                link = _member(str(place), tarfile.SYMTYPE)
                link.linkname = image.links[place]
                layer.addfile(link)
            else:
                _add(layer, str(place), image.files[place].read_bytes())
    return buffer.getvalue()


def _member(name: str, kind: bytes) -> tarfile.TarInfo:
    member = tarfile.TarInfo(name)
    member.type = kind
    member.mode = 0o755
    return member


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = _member(name, tarfile.REGTYPE)
    member.size = len(content)
    archive.addfile(member, io.BytesIO(content))


def _descriptor(kind: str, blob: bytes) -> dict[str, object]:
    return {"mediaType": MEDIA_TYPE + kind, "digest": _digest(blob), "size": len(blob)}


def _entry(name: str, manifest: bytes) -> dict[str, object]:
    return {
        **_descriptor("manifest.v1+json", manifest),
        "platform": {"architecture": "amd64", "os": "linux"},
        "annotations": {
            "io.containerd.image.name": name,
            "org.opencontainers.image.ref.name": name.rpartition(":")[2],
        },
    }


def _digest(content: bytes) -> str:
    return "sha256:" + hashlib.sha256(content).hexdigest()


def _json(value: object) -> bytes:
    return json.dumps(value).encode()
