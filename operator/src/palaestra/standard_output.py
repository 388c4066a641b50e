"""Standard output that cannot be written, because its reader has ended or the disk is full.

Without these functions, Python would end a command with a traceback, and a run with it.
"""

import os
import sys


def flush_output() -> None:
    """Write the lines that wait in the buffer; a process may also have been started without standard output.

    Raises:
        OSError: the lines cannot be written.
    """
    if sys.stdout is not None:
        sys.stdout.flush()


def drop_output() -> None:
    """Discard all further lines, and the lines that still wait in the buffer."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def output_fails() -> bool:
    """Write an empty line, and return whether that fails.

    An OSError does not say whether standard output or another file caused it.
    """
    try:
        sys.stdout.write("\n")
        sys.stdout.flush()
    except OSError:
        return True
    return False
