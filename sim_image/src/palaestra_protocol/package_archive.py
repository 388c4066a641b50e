"""A policy package as one file: a zip that holds only plain files with plain names.

Nothing is unpacked to a disk. Before `zipfile` reads the archive's list of files, the size of the list is
checked, because a list of millions of files would fill the memory. The whole archive is refused if a name in
it is a path, a name occurs twice, or an entry is a link. A person may unpack such an archive with a program
that lacks these checks.
"""

from __future__ import annotations

import io
import re
import stat
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo

from palaestra_protocol.fields import ProtocolError

FILE_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,254}")
MOST_MEMBERS: Final = 128
MEMBER_ERRORS: Final = (BadZipFile, EOFError, NotImplementedError, RuntimeError, zlib.error)

_MOST_LIST_BYTES: Final = 2**17
_ENCRYPTED: Final = 0x1
_UNIX: Final = 3
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)  # earliest time; if it is fixed, equal files give equal bytes
# Source: APPNOTE.TXT of PKWARE, sections 4.3.16 and 4.3.15.
_END: Final = struct.Struct("<4s4H2LH")
_END_MARK: Final = b"PK\x05\x06"
_LARGE_MARK: Final = b"PK\x06\x07"  # starts 20 bytes before `_END`, in archives with 64-bit numbers only
_LARGE_BYTES: Final = 20


def archived(files: Mapping[str, bytes]) -> bytes:
    """Return a zip of `files` (contents by name); its bytes depend only on the names and contents.

    The contents are not compressed: another release of zlib would write other bytes, and the weights of a
    network hardly become smaller.
    """
    content = io.BytesIO()
    with ZipFile(content, "w", ZIP_STORED) as archive:
        for name, data in sorted(files.items()):
            member = ZipInfo(name, _EPOCH)
            member.create_system, member.external_attr = _UNIX, (stat.S_IFREG | 0o644) << 16
            archive.writestr(member, data)
    return content.getvalue()


@contextmanager
def opened(path: Path) -> Iterator[ZipFile]:
    """Open a zip whose members are all plain files with plain names.

    Raises:
        ProtocolError: the file is not a zip, or a member does not belong in a package.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        _refuse_long_list(file)
        try:
            archive = ZipFile(file)
        except (BadZipFile, ValueError, NotImplementedError) as error:
            raise ProtocolError(f"is not a zip of a package ({error})") from error
        with archive:
            _refuse_members(archive.infolist())
            yield archive


def has_member(path: Path, name: str) -> bool:
    """Return whether a file is a zip of plain files, one of which has this name."""
    try:
        with opened(path) as archive:
            return name in archive.namelist()
    except (ProtocolError, OSError):
        return False


def _refuse_long_list(file: BinaryIO) -> None:
    """Raise `ProtocolError` unless the file ends like a zip that has few files and no comment."""
    size = file.seek(0, io.SEEK_END)
    file.seek(max(size - _END.size - _LARGE_BYTES, 0))
    tail = file.read()
    if len(tail) < _END.size or tail[-_END.size :][:4] != _END_MARK:
        raise ProtocolError("is not a zip of a package, or has lost its end")
    if tail[: -_END.size].startswith(_LARGE_MARK):
        raise ProtocolError("is a zip of more than 4 GiB or 65,535 files")
    _, _, _, _, members, list_bytes, _, _ = _END.unpack(tail[-_END.size :])
    if members > MOST_MEMBERS or list_bytes > _MOST_LIST_BYTES:
        raise ProtocolError(f"has more than {MOST_MEMBERS} files, or a longer list of files than these need")


def _refuse_members(members: list[ZipInfo]) -> None:
    seen: set[str] = set()
    for member in members:
        name = member.filename
        if not FILE_NAME.fullmatch(name):
            raise ProtocolError(f"has {name[:40]!r}, which is not the name of a file in the package")
        if name in seen:
            raise ProtocolError(f"has {name} twice")
        if stat.S_IFMT(member.external_attr >> 16) not in {0, stat.S_IFREG}:
            raise ProtocolError(f"has {name}, which is not a plain file")
        if member.flag_bits & _ENCRYPTED or member.compress_type not in {ZIP_STORED, ZIP_DEFLATED}:
            raise ProtocolError(f"has {name} encrypted, or compressed in another way than by deflate")
        seen.add(name)
