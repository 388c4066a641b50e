"""Save and load a replay buffer in chunks of rows; later checkpoints share the unchanged chunks.

Few rows change between two checkpoints. For a chunk without a changed row, the new checkpoint has a hard link
to the file of the previous checkpoint. If the volume does not support hard links, the new checkpoint has a
copy of the file.
"""

from __future__ import annotations

import math
import os
import shutil
from pathlib import Path

import numpy as np

from palaestra_protocol.whole_file import sync
from palaestra_trainer.algorithms.buffers import ValidReplayBuffer
from palaestra_trainer.run.checkpoint.manifest import EXPERIENCE, SavedCheckpoint, digest_of


def write(buffer: ValidReplayBuffer, folder: Path, before: SavedCheckpoint | None) -> dict[str, str]:
    """Write the rows in use into a checkpoint's folder; return the digest of each file by its name.

    Args:
        buffer: the buffer; its attribute `changed` names the chunks that differ from `before`.
        folder: the folder of the new checkpoint.
        before: the previous checkpoint of the same buffer; None: every chunk is written.
    """
    (folder / EXPERIENCE).mkdir()
    known = before.manifest.files if before else {}
    digests = {}
    for chunk in range(math.ceil(buffer.size() / buffer.chunk_rows)):
        name = f"{EXPERIENCE}/{chunk:05}.npy"
        if (
            before
            and name in known
            and chunk not in buffer.changed
            and _share(before.path / name, folder / name)
        ):
            digests[name] = known[name]
        else:
            _write_chunk(buffer, chunk, folder / name)
            digests[name] = digest_of(folder / name)
    sync(folder / EXPERIENCE)
    return digests


def read(buffer: ValidReplayBuffer, found: SavedCheckpoint) -> None:
    """Load the rows of a checkpoint into an equal buffer, whose write positions are already restored.

    The rows of lost chunks are dropped from the buffer.

    Raises:
        ValueError: the rows have another shape, or a file contains pickled data.
    """
    names = sorted(name for name in found.manifest.files if name.startswith(EXPERIENCE))
    kept = np.ones(buffer.buffer_size, dtype=bool)
    for chunk, name in enumerate(names):
        start = chunk * buffer.chunk_rows
        if name in found.lost:
            kept[start : start + buffer.chunk_rows] = False
            continue
        with (found.path / name).open("rb") as file:
            buffer.fill(start, {column: np.load(file, allow_pickle=False) for column in buffer.rows(0, 0)})
    buffer.changed.clear()
    if found.lost:
        buffer.keep(kept)


def _write_chunk(buffer: ValidReplayBuffer, chunk: int, path: Path) -> None:
    start = chunk * buffer.chunk_rows
    with path.open("wb") as file:
        for column in buffer.rows(start, min(start + buffer.chunk_rows, buffer.size())).values():
            np.save(file, column, allow_pickle=False)
        file.flush()
        os.fsync(file.fileno())


def _share(old: Path, new: Path) -> bool:
    """Make `new` a hard link to `old`, or a copy; return False if `old` is missing."""
    try:
        os.link(old, new)
    except FileNotFoundError:
        return False
    except OSError:  # the volume does not support hard links, or the file has too many links
        shutil.copyfile(old, new)
        sync(new)
    return True
