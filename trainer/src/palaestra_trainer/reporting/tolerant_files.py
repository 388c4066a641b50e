"""Files of a run that may be missing, damaged or still written: their content, or nothing; never an error."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from palaestra_trainer.reporting.plain_values import record

MOST_LINES_BYTES = 32 * 2**20  # of a file of lines; only its end is read
MOST_FILE_BYTES = 2**20  # of a file that is read whole


def lines(path: Path) -> Iterator[Mapping[str, Any]]:
    """Yield the JSON objects of a file of lines, without damaged ones; of a large file only its end."""
    for line in tail(path, MOST_LINES_BYTES).splitlines():
        with suppress(ValueError, RecursionError):
            content = json.loads(line)
            if isinstance(content, dict):
                yield content


def json_file(path: Path) -> Mapping[str, Any]:
    """Return the JSON object in a file; an empty one if it is missing, larger than expected, or damaged."""
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
    """Return the first bytes of a file; empty if it cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(max(most, 0))
    except OSError:
        return b""


def tail(path: Path, most: int) -> bytes:
    """Return the last bytes of a file; empty if it cannot be read."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(max(size - most, 0))
            return file.read(max(most, 0))
    except OSError:
        return b""
