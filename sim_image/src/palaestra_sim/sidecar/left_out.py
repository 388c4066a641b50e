"""The file in which a simulator reports the nodes that it leaves out of its world.

The simulator may be any program, so the size of the file is limited. The simulator's log could not replace
the file, because each simulator has its own format of log lines.
"""

from pathlib import Path

_MOST_BYTES = 2**16


def read_left_out(file: Path) -> tuple[str, ...]:
    """Return the non-empty lines of the file; () if the file cannot be read."""
    try:
        if not file.is_file():  # opening a pipe would block
            return ()
        with file.open("rb") as opened:
            text = opened.read(_MOST_BYTES).decode("utf-8", "replace")
    except OSError:
        return ()
    return tuple(line for line in map(_printable, text.splitlines()) if line)


def _printable(line: str) -> str:
    return " ".join("".join(letter if letter.isprintable() else " " for letter in line).split())
