"""Report to the sidecar which nodes a simulator leaves out; see `palaestra_protocol.control`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from palaestra_protocol.whole_file import write_whole
from palaestra_sim.errors import WorldError

_MOST_PLACES: Final = 8  # maximum number of line numbers in one report line


def write_left_out(left_out: Iterable[WorldError], file: Path) -> None:
    """Write `file` with one line for each kind of node.

    Raises:
        OSError: the file cannot be written; no partial file is left.
    """
    write_whole(file, "".join(f"{line}\n" for line in left_out_lines(left_out)).encode())


def left_out_lines(left_out: Iterable[WorldError]) -> Iterator[str]:
    """Yield a line for each kind of node, with the line numbers of these nodes in the world file."""
    kinds: dict[tuple[str, str], list[WorldError]] = {}
    for error in left_out:
        kinds.setdefault((error.world, error.fact), []).append(error)
    for (file, fact), errors in kinds.items():
        count = "1 node" if len(errors) == 1 else f"{len(errors)} nodes"
        yield f"{fact}: {count} left out ({file}, {_places(errors)})"


def _places(errors: Iterable[WorldError]) -> str:
    lines = list(dict.fromkeys(error.line for error in errors))
    named = ", ".join(map(str, lines[:_MOST_PLACES]))
    more = f" and {len(lines) - _MOST_PLACES} more" if len(lines) > _MOST_PLACES else ""
    return f"{'line' if len(lines) == 1 else 'lines'} {named}{more}"
