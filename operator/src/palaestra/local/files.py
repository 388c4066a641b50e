"""Write the files of a local run, and name the folder in each message about a failure."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from palaestra.local.errors import StorageFailed
from palaestra_protocol.whole_file import replace_file


def write(path: Path, content: bytes) -> None:
    """Create or replace the file `path`, and create its folders.

    Raises:
        StorageFailed: the file cannot be written; the old content is unchanged.
    """
    with storage(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, lambda unfinished: unfinished.write_bytes(content))


def make_folder(path: Path) -> None:
    """Create `path` and its parents if they do not exist.

    Raises:
        StorageFailed: the folder cannot be created.
    """
    with storage(path):
        path.mkdir(parents=True, exist_ok=True)


def without_locks(path: Path, error: OSError) -> str:
    """Return the message about a file or folder that cannot be locked."""
    return (
        f"{path}: the file system has no locks ({error.strerror}), and without locks two runs could write "
        "into the same directory; choose a folder on a local disk with --dir"
    )


@contextmanager
def storage(path: Path) -> Iterator[None]:
    """Replace an OSError about `path` by a StorageFailed with a one-line message.

    Raises:
        StorageFailed: the block failed with an OSError.
    """
    try:
        yield
    except OSError as error:
        raise StorageFailed(f"{path}: {error.strerror}; choose another folder with --dir") from error
