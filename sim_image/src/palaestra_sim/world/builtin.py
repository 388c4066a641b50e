"""The worlds that ship, by name."""

from importlib.resources import files

from palaestra_sim.errors import UnknownWorldError


def builtin(name: str) -> bytes:
    """Return the source world that ships as `name`, such as "arena".

    Raises:
        UnknownWorldError: there is none of that name; the message names those there are.
    """
    worlds = {
        entry.name.removesuffix(".wbt"): entry
        for entry in files("palaestra_sim").joinpath("worlds").iterdir()
        if entry.name.endswith(".wbt")
    }
    if name not in worlds:
        known = ", ".join(sorted(worlds))
        raise UnknownWorldError(f'no world "{name}" ships; choose one of {known}')
    return worlds[name].read_bytes()
