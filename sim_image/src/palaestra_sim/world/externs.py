"""The PROTO files that a world names by a path: those beside it are read, those on the network are not.

Only `local_protos` reads files, through a function that the caller gives.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from palaestra_sim.errors import WorldError
from palaestra_sim.world.reader import parse_proto
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, unquoted
from palaestra_sim.world.tree import Proto, World

_WITH_SCHEME = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)
_MOST_FILES = 500  # a world that names more is damaged, or a trap

Read = Callable[[Path], bytes]


@dataclass(slots=True)
class LocalProtos:
    """The PROTO files beside a world.

    Attributes:
        protos: those that can be expanded, by name.
        unusable: why the others cannot be, by name: a template, a mistake, a file that cannot be read.
    """

    protos: dict[str, Proto] = field(default_factory=dict)
    unusable: dict[str, WorldError] = field(default_factory=dict)


def local_protos(world: World, path: Path, read: Read = Path.read_bytes) -> LocalProtos:
    """Return the PROTOs that a world and its PROTOs name by a path, or by a file address.

    Args:
        world: as read.
        path: of its file; addresses are relative to the file that names them.
        read: returns the bytes of a file, or raises OSError.
    """
    found = LocalProtos()
    waiting = _addresses(world.externs, Source(data=world.source, name=str(path)), path)
    while waiting and len(found.protos) + len(found.unusable) < _MOST_FILES:
        name, file, where = waiting.pop(0)
        if name in found.protos or name in found.unusable:
            continue
        try:
            proto = parse_proto(read(file), str(file))
        except WorldError as error:
            found.unusable[name] = error
        except OSError as error:
            fact = f"the PROTO file {file} cannot be read: {error.strerror}"
            found.unusable[name] = where(fact, "put it there, or correct the address")
        else:
            found.protos[name] = proto
            waiting += _addresses(proto.externs, proto.source, file)
    return found


_Where = Callable[[str, str], WorldError]  # from a fact and a remedy


def _addresses(externs: Iterable[Token], source: Source, file: Path) -> list[tuple[str, Path, _Where]]:
    """Return name and path of each local PROTO that a file names, and how to report an error there."""
    found: list[tuple[str, Path, _Where]] = []
    for token in externs:
        address = unquoted(token)
        if _WITH_SCHEME.match(address):
            continue

        def where(fact: str, remedy: str, start: int = token.start) -> WorldError:
            return source.error(start, fact, remedy)

        found.append((PurePosixPath(address).stem, (file.parent / address), where))
    return found
