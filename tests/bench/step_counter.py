"""The number of a training's steps, in a file that another process reads while the training runs."""

import mmap
import struct
from pathlib import Path

NUMBER = struct.Struct("<q")
NAME = "steps"  # the name of the file in the folder of a training


class StepCounter:
    """A number in a file; writing it takes a microsecond, so it does not slow a step down.

    Args:
        folder: the folder of the training; the file is created with the number 0 if it does not exist.
    """

    def __init__(self, folder):
        path = Path(folder) / NAME
        if not path.exists():
            path.write_bytes(bytes(NUMBER.size))
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), NUMBER.size)

    @property
    def value(self):
        """The number that was written last."""
        return NUMBER.unpack_from(self._memory)[0]

    @value.setter
    def value(self, number):
        NUMBER.pack_into(self._memory, 0, number)
