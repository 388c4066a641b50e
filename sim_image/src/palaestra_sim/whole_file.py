"""Write a file atomically: at each moment, and after a kill, it has its old or its new content."""

from __future__ import annotations

import os
from pathlib import Path


def write_whole(path: Path, content: bytes) -> None:
    """Create or replace `path`, whose folder exists.

    The write does not wait for the disk, because a simulator's files are written again after a crash.

    Raises:
        OSError: it cannot be written; no partial file is left.
    """
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
