"""The worlds that ship, by name."""

from pathlib import Path

from palaestra_sim.errors import UnknownWorldError

_WORLDS = Path(__file__).parent.parent / "worlds"


def builtin(name: str) -> bytes:
    """Return the source world that ships as `name`, such as "arena".

    Raises:
        UnknownWorldError: there is no world of that name; the message names the existing ones.
    """
    path = builtin_path(name)
    if path is None:
        known = ", ".join(sorted(_shipped()))
        raise UnknownWorldError(f'no world "{name}" ships; choose one of {known}')
    return path.read_bytes()


def builtin_path(name: str) -> Path | None:
    """Return the file of the world that ships as `name`; None if there is none."""
    return _shipped().get(name)


def _shipped() -> dict[str, Path]:
    return {path.stem: path for path in _WORLDS.glob("*.wbt")}
