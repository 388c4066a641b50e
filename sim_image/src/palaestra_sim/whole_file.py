"""Write a file atomically: a reader sees the old or the new content, even if the writer is killed."""

from __future__ import annotations

import os
from pathlib import Path


def write_whole(path: Path, content: bytes) -> None:
    """Create or replace the file `path`; its folder must exist.

    The function does not wait until the content is on the disk, because a simulator's files are written again
    after a crash of the machine.

    Raises:
        OSError: the file cannot be written; no partial file is left.
    """
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
