"""Find the PROTO files that lie beside a world.

A world names the file of each PROTO that it uses in an EXTERNPROTO line, and a PROTO file does so for those
that it uses. An address with a scheme (https://, webots://) is a PROTO that Webots brings: no file is read,
and only its name is known. A relative address counts from the folder of the file that names it.

A PROTO that cannot be used is no error here, since the world may do without it: a stand-in may describe it,
or its instances may be left out. Its error is in the result, for the caller that needs it.
"""

import re
from collections.abc import Callable, Container, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from palaestra_sim.errors import WorldError
from palaestra_sim.world.proto import Proto, parse_proto
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, unquoted
from palaestra_sim.world.tree import World

MAX_FILES_DEEP = 20
"""PROTO files that name each other in a row."""

_SCHEME = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)

Read = Callable[[Path], bytes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Protos:
    """The PROTOs that a world and its PROTO files name, by type.

    `local` were read from files. `remote` are the types of addresses with a scheme. `refused` has the error
    of each type that is in no other part because its file is missing, is no PROTO, has a template, or names
    itself through others.
    """

    local: dict[str, Proto] = field(default_factory=dict)
    remote: set[str] = field(default_factory=set)
    refused: dict[str, WorldError] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Namer:
    """A file with EXTERNPROTO lines: a world, or a PROTO of the type `type_name`."""

    path: Path | None
    source: Source
    externs: tuple[Token, ...]
    type_name: str | None = None
    above: tuple["_Namer", ...] = ()


def local_protos(
    world_path: Path | None,
    world: World,
    *,
    name: str = "world",
    without: Container[str] = (),
    read: Read = Path.read_bytes,
) -> Protos:
    """Return the PROTOs that `world` and its local PROTO files name.

    `world_path` is the file of the world, None if it has none; `name` is its name in errors. Files of the
    types in `without` are not read, and those types are in no part of the result. `read` returns the bytes of
    a file or raises OSError.
    """
    search = _Search(without, read)
    source = Source(data=world.source, name=name)
    search.follow(_Namer(path=world_path, source=source, externs=world.externs))
    return search.found


class _Search:
    """The PROTOs found so far, and the file of each type."""

    def __init__(self, without: Container[str], read: Read) -> None:
        self.found = Protos()
        self._without = without
        self._read = read
        self._files: dict[str, Path] = {}

    def follow(self, namer: _Namer) -> None:
        """Add all that a file names, and what those files name."""
        for token in namer.externs:
            address = unquoted(token)
            type_name = PurePosixPath(address).name.removesuffix(".proto")
            if type_name in self._without:
                continue
            if _SCHEME.match(address):
                self.found.remote.add(type_name)
                continue
            try:
                self._add(namer, token, address, type_name)
            except WorldError as error:
                self.found.refused.setdefault(type_name, error)
                self.found.local.pop(type_name, None)

    def _add(self, namer: _Namer, token: Token, address: str, type_name: str) -> None:
        """Add the PROTO of a relative address, unless its file was already read."""
        if namer.path is None:
            fact = f"{token.text.decode()} is relative to the file of the world, and this one has none"
            remedy = "begin it with webots:// or https://, or give the world as a file"
            raise namer.source.error(token.start, fact, remedy)
        path = namer.path.parent / address
        for problem in _endless(namer, type_name):
            raise namer.source.error(token.start, *problem)
        if self._files.setdefault(type_name, _plain(path)) != _plain(path):
            fact = f"{address} is a second file of the type {type_name}, after {self._files[type_name]}"
            raise namer.source.error(token.start, fact, "rename one of the two types")
        if type_name in self.found.local or type_name in self.found.refused:
            return
        proto = self._proto(namer, token, path, type_name)
        self.found.local[type_name] = proto
        self.follow(
            _Namer(
                path=path,
                source=proto.source,
                externs=proto.externs,
                type_name=type_name,
                above=(*namer.above, namer),
            )
        )

    def _proto(self, namer: _Namer, token: Token, path: Path, type_name: str) -> Proto:
        """Return the PROTO of a file."""
        try:
            data = self._read(path)
        except (OSError, ValueError) as error:  # ValueError: a path with a NUL
            reason = getattr(error, "strerror", None) or error
            fact = f"{path} cannot be read: {reason}"
            remedy = "correct the address; it counts from the folder of this file"
            raise namer.source.error(token.start, fact, remedy) from None
        proto = parse_proto(data, str(path))
        if proto.name != type_name:
            fact = f"the file {path.name} declares the PROTO {proto.name}"
            raise proto.source.error(0, fact, "give file and PROTO the same name")
        return proto


def _endless(namer: _Namer, type_name: str) -> Iterator[tuple[str, str]]:
    """Yield the fact and the remedy if the files that name each other have no end."""
    above = [file.type_name for file in (*namer.above, namer)]
    if type_name in above:
        fact = f"{namer.type_name} and {type_name} are made of each other"
        if namer.type_name == type_name:
            fact = f"{type_name} is made of itself"
        yield fact, f"remove {type_name} from {namer.type_name}"
    if len(above) > MAX_FILES_DEEP:
        fact = f"PROTO files name each other more than {MAX_FILES_DEEP} deep"
        yield fact, "declare fewer PROTOs by others"


def _plain(path: Path) -> Path:
    """Return a path without `.` and `..`, so that two spellings of one file are equal."""
    parts: list[str] = []
    for part in path.parts:
        if part == ".." and parts and parts[-1] not in ("..", "/"):
            parts.pop()
        else:
            parts.append(part)
    return Path(*parts)
