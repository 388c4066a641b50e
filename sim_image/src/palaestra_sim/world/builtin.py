"""The built-in worlds and descriptions of robots, by name."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from palaestra_sim.errors import UnknownWorldError
from palaestra_sim.world.proto import Proto, parse_proto

_WORLDS = Path(__file__).parent.parent / "worlds"
_PROTOS = Path(__file__).parent / "protos"


def builtin(name: str) -> bytes:
    """Return the built-in source world `name`, such as "arena".

    Raises:
        UnknownWorldError: no built-in world has that name; the message lists the existing names.
    """
    path = builtin_path(name)
    if path is None:
        known = ", ".join(sorted(_shipped()))
        raise UnknownWorldError(f'no built-in world is called "{name}"; choose one of {known}')
    return path.read_bytes()


def builtin_path(name: str) -> Path | None:
    """Return the file of the built-in world `name`; None if no world has that name."""
    return _shipped().get(name)


@cache
def builtin_protos() -> Mapping[str, Proto]:
    """Return the built-in descriptions of Webots' robots, by the names of their PROTOs."""
    return {path.stem: parse_proto(path.read_bytes(), path.name) for path in sorted(_PROTOS.glob("*.proto"))}


def _shipped() -> dict[str, Path]:
    return {path.stem: path for path in _WORLDS.glob("*.wbt")}
