"""Read a file of a world, up to a maximum size.

The limit exists because a link may lead to an endless device, such as /dev/zero.
"""

import errno
import stat
from pathlib import Path
from typing import Final

MOST_BYTES: Final = 64 << 20
"""Maximum size of one file; the largest worlds of public projects have a tenth of this size."""


def read_bounded(path: Path) -> bytes:
    """Return the bytes of a file.

    Raises:
        OSError: the file cannot be read, is not a regular file, or is too large.
    """
    if not stat.S_ISREG(path.stat().st_mode):  # opening a pipe blocks until a process writes to it
        raise OSError(errno.EINVAL, "is not a regular file", str(path))
    with path.open("rb") as file:
        found = file.read(MOST_BYTES + 1)
    if len(found) > MOST_BYTES:
        raise OSError(errno.EFBIG, f"has more than {MOST_BYTES} bytes", str(path))
    return found
