"""Write files so that a reader, or a crash, finds the old content or the new, never half of one."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from palaestra.local.errors import StorageFailed


def write(path: Path, content: bytes) -> None:
    """Replace `path`, or make it, with its folders.

    Raises:
        StorageFailed: it cannot be written; what was there is unharmed.
    """
    with storage(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            Path(temporary).chmod(0o644)
            Path(temporary).replace(path)
        except OSError:
            Path(temporary).unlink(missing_ok=True)
            raise


def make_folder(path: Path) -> None:
    """Make `path` and its parents where they are missing.

    Raises:
        StorageFailed: it cannot be made.
    """
    with storage(path):
        path.mkdir(parents=True, exist_ok=True)


@contextmanager
def storage(path: Path) -> Iterator[None]:
    """Tell what an operating system says about `path` as one clear line.

    Raises:
        StorageFailed: the block failed with an OSError.
    """
    try:
        yield
    except OSError as error:
        raise StorageFailed(f"{path}: {error.strerror}; choose another folder with --dir") from error
