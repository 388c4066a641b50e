"""Read the files that are named on the command line."""

import argparse
from pathlib import Path

from palaestra.api import TrainingJob, load
from palaestra.bounded_read import MOST_JOB_BYTES, MOST_WORLD_BYTES, read_bounded
from palaestra.errors import PalaestraError


def job(file: Path) -> TrainingJob:
    """Return the TrainingJob in a file.

    Raises:
        PalaestraError: the file cannot be read, or its job is invalid.
    """
    return load(read_text(file), str(file))


def read_text(file: Path) -> str:
    """Return the text of a file.

    Raises:
        PalaestraError: the file cannot be read, or is not UTF-8.
    """
    try:
        return read(file, MOST_JOB_BYTES).decode()
    except UnicodeDecodeError:
        raise PalaestraError(f"{file}: is not UTF-8; save it as UTF-8") from None


def read(file: Path, most_bytes: int = MOST_WORLD_BYTES) -> bytes:
    """Return the content of a file.

    Raises:
        PalaestraError: the file cannot be read, or is larger than `most_bytes`.
    """
    try:
        return read_bounded(file, most_bytes)
    except OSError as error:
        raise PalaestraError(f"{file}: {error.strerror}; name a readable file") from error


def add_dir(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the folder of all runs."""
    parser.add_argument("--dir", type=Path, default=Path("runs"), help="folder of all runs; default: runs")
