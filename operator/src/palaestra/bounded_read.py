"""Read files that a person names, up to a maximum size: a file may be a disk image or an endless device."""

import os
import stat
from pathlib import Path

from palaestra.errors import PalaestraError

MOST_JOB_BYTES = 2**23  # eight times the limit of an API server, because YAML may escape each letter
MOST_WORLD_BYTES = 2**26


class TooLarge(PalaestraError):
    """A file is larger than the maximum for its kind."""


def read_bounded(file: Path, most_bytes: int) -> bytes:
    """Return the content of a file.

    Raises:
        TooLarge: the file has more than `most_bytes` bytes; a regular file is then not read at all.
        OSError: the file cannot be read.
    """
    with file.open("rb") as content:
        status = os.fstat(content.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_size <= most_bytes:
            found = content.read(most_bytes + 1)
            if len(found) <= most_bytes:
                return found
    raise TooLarge(
        f"{file}: is larger than {most_bytes >> 20} MiB, the limit for such a file; name another file"
    )
