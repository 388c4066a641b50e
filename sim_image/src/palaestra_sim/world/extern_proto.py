"""Find the PROTO files that belong to a world.

A world or a PROTO file has an EXTERNPROTO line with an address for each PROTO that it uses. An address with a
scheme (https://, webots://) belongs to a PROTO that Webots provides. This module does not read the file of
such a PROTO, and records only its name. A relative address is relative to the folder of the file that has the
EXTERNPROTO line.

Files from before R2022b do not have such lines: Webots found PROTOs by their names in the folder `protos/` of
the world's project, and in its subfolders. This module does the same for such files.

A PROTO that cannot be used does not raise an error here, because the world may not need the PROTO: a stand-in
may describe it, or its instances may be left out. The error is in the result, for callers that need the
PROTO.
"""

import re
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from palaestra_sim.errors import WorldError
from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.proto import Proto, parse_proto
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, unquoted
from palaestra_sim.world.tree import Node, World, walk

MAX_FILES_DEEP = 20
"""Maximum length of a chain of PROTO files that name each other."""

_SCHEME = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)

Read = Callable[[Path], bytes]
List = Callable[[Path], Iterable[Path]]


def _protos_below(folder: Path) -> list[Path]:
    """Return the PROTO files in a folder and its subfolders, those with the shortest paths first."""
    return sorted(folder.rglob("*.proto"), key=lambda path: (len(path.parts), path))


@dataclass(frozen=True, slots=True, kw_only=True)
class Protos:
    """The PROTOs that a world and its PROTO files name, by type.

    `local` has the PROTOs that were read from files. `remote` are the types whose addresses have a scheme.
    `refused` has the errors of all other types: the file is missing, is not a PROTO, has a template, or names
    itself through other files.
    """

    local: dict[str, Proto] = field(default_factory=dict)
    remote: set[str] = field(default_factory=set)
    refused: dict[str, WorldError] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Namer:
    """A file that can name PROTOs: a world, or the PROTO file of the type `type_name`."""

    path: Path | None
    source: Source
    externs: tuple[Token, ...]
    nodes: tuple[Node, ...] = ()
    type_name: str | None = None
    above: tuple["_Namer", ...] = ()


def local_protos(
    world_path: Path | None,
    world: World,
    *,
    name: str = "world",
    without: Container[str] = (),
    read: Read = read_bounded,
    files_below: List = _protos_below,
) -> Protos:
    """Return the PROTOs that `world` and its local PROTO files name.

    `world_path` is the file of the world, None without a file; `name` is its name in errors. Types in
    `without` are ignored: their files are not read, and the result does not contain them. `read` returns the
    bytes of a file or raises OSError. `files_below` returns the PROTO files in a folder and its subfolders.
    """
    source = Source(data=world.source, name=name)
    search = _Search(world_path, without, read, files_below)
    search.follow(_Namer(path=world_path, source=source, externs=world.externs, nodes=world.nodes))
    return search.found


class _Search:
    """The PROTOs found so far, and the file of each type."""

    def __init__(
        self, world_path: Path | None, without: Container[str], read: Read, files_below: List
    ) -> None:
        self.found = Protos()
        self._without = without
        self._read = read
        self._files: dict[str, Path] = {}
        self._project = None if world_path is None else world_path.parent.parent
        self._files_below = files_below
        self._by_name: dict[str, Path] | None = None

    def follow(self, namer: _Namer) -> None:
        """Add the PROTOs that a file names, and all PROTOs that the files of these PROTOs name."""
        for token in namer.externs:
            address = unquoted(token)
            type_name = PurePosixPath(address).name.removesuffix(".proto")
            if type_name in self._without:
                continue
            if _SCHEME.match(address):
                self.found.remote.add(type_name)
                continue
            path = None if namer.path is None else namer.path.parent / address
            self._try(namer, token.start, address, path, type_name)
        if namer.source.older_than(2022, "b"):
            self._follow_names(namer)

    def _follow_names(self, namer: _Namer) -> None:
        """Add the PROTOs of the project that a file before R2022b uses by name."""
        for node in walk(namer.nodes):
            path = self._of_project(node.type_name)
            if path is not None and node.type_name not in self._without:
                self._try(namer, node.span[0], node.type_name, path, node.type_name)

    def _of_project(self, type_name: str) -> Path | None:
        if self._by_name is None:
            files = [] if self._project is None else self._files_below(self._project / "protos")
            self._by_name = {}
            for path in files:
                self._by_name.setdefault(path.stem, path)
        return self._by_name.get(type_name)

    def _try(self, namer: _Namer, place: int, address: str, path: Path | None, type_name: str) -> None:
        """Add the PROTO of a file, or the error of the file."""
        try:
            self._add(namer, place, address, path, type_name)
        except WorldError as error:
            self.found.refused.setdefault(type_name, error)
            self.found.local.pop(type_name, None)

    def _add(self, namer: _Namer, place: int, address: str, path: Path | None, type_name: str) -> None:
        """Add the PROTO of a file, unless it was already read."""
        if path is None:
            fact = f'"{address}" is relative to the file of the world, and this world is not in a file'
            remedy = "begin the address with webots:// or https://, or give the world as a file"
            raise namer.source.error(place, fact, remedy)
        for problem in _endless(namer, type_name):
            raise namer.source.error(place, *problem)
        if self._files.setdefault(type_name, _plain(path)) != _plain(path):
            fact = f"{address} is a second file of the type {type_name}, after {self._files[type_name]}"
            raise namer.source.error(place, fact, "rename one of the two types")
        if type_name in self.found.local or type_name in self.found.refused:
            return
        proto = self._proto(namer, place, path, type_name)
        self.found.local[type_name] = proto
        self.follow(
            _Namer(
                path=path,
                source=proto.source,
                externs=proto.externs,
                nodes=(proto.body, *_defaults(proto)),
                type_name=type_name,
                above=(*namer.above, namer),
            )
        )

    def _proto(self, namer: _Namer, place: int, path: Path, type_name: str) -> Proto:
        """Return the PROTO of a file."""
        try:
            data = self._read(path)
        except (OSError, ValueError) as error:  # ValueError: a path with a NUL character
            reason = getattr(error, "strerror", None) or error
            fact = f"{path} cannot be read: {reason}"
            remedy = "correct the address; it is relative to the folder of this file"
            raise namer.source.error(place, fact, remedy) from None
        proto = parse_proto(data, str(path))
        if proto.name != type_name:
            fact = f"the file {path.name} declares the PROTO {proto.name}"
            raise proto.source.error(0, fact, "give the file and the PROTO the same name")
        return proto


def _defaults(proto: Proto) -> Iterator[Node]:
    """Yield the nodes in the defaults of a PROTO's fields."""
    for declared in proto.fields.values():
        yield from (item for item in declared.default.items if isinstance(item, Node))


def _endless(namer: _Namer, type_name: str) -> Iterator[tuple[str, str]]:
    """Yield the fact and the remedy if the chain of files has a cycle or is too long."""
    above = [file.type_name for file in (*namer.above, namer)]
    if type_name in above:
        fact = f"{namer.type_name} and {type_name} contain each other"
        if namer.type_name == type_name:
            fact = f"{type_name} contains itself"
        yield fact, f"remove {type_name} from {namer.type_name}"
    if len(above) > MAX_FILES_DEEP:
        fact = f"PROTO files name each other more than {MAX_FILES_DEEP} deep"
        yield fact, "nest fewer PROTO files"


def _plain(path: Path) -> Path:
    """Return a path without `.` and `..`, so that two spellings of one file are equal."""
    parts: list[str] = []
    for part in path.parts:
        if part == ".." and parts and parts[-1] not in ("..", "/"):
            parts.pop()
        else:
            parts.append(part)
    return Path(*parts)
