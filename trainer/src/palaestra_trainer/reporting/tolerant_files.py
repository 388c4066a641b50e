"""Read files of a run that may be missing, damaged or incomplete; the functions do not raise for these."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from palaestra_trainer.reporting.plain_values import record

MOST_LINES_BYTES = 32 * 2**20  # of a larger file of lines, only the end is read
MOST_FILE_BYTES = 2**20  # limit for a file that is read whole


def lines(path: Path) -> Iterator[Mapping[str, Any]]:
    """Yield the JSON objects in the lines of a file, or of the end of a large file; skip damaged lines."""
    for line in tail(path, MOST_LINES_BYTES).splitlines():
        with suppress(ValueError, RecursionError):
            content = json.loads(line)
            if isinstance(content, dict):
                yield content


def json_file(path: Path) -> Mapping[str, Any]:
    """Return the JSON object in a file; an empty object if the file is missing, too large or damaged."""
    try:
        return record(json.loads(tail(path, MOST_FILE_BYTES)))
    except (ValueError, RecursionError):
        return {}


def yaml_file(path: Path) -> Any:
    """Return the content of a YAML file; None if it is missing or damaged."""
    try:
        return yaml.safe_load(tail(path, MOST_FILE_BYTES))
    except (yaml.YAMLError, ValueError, RecursionError):
        return None


def head(path: Path, most: int) -> bytes:
    """Return the first `most` bytes of a file; no bytes if the file cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(max(most, 0))
    except OSError:
        return b""


def tail(path: Path, most: int) -> bytes:
    """Return the last `most` bytes of a file; no bytes if the file cannot be read."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(max(size - most, 0))
            return file.read(max(most, 0))
    except OSError:
        return b""
