"""Show a run that this program starts: run `palaestra view` in a separate process.

This module imports neither viser nor the cluster's client, so a run without a page does not need their time
and memory.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path

from palaestra.live_view.source import ViewError

WITH_STDIN, OPENED = "--until-stdin-closes", "--open-browser"
VIEW_ENDS_S = 5.0


class ViserMissing(ViewError):
    """The optional package is not installed."""


def require_viser() -> None:
    """Check that a view can be shown.

    Raises:
        ViserMissing: an optional package is not installed.
    """
    if find_spec("viser") is None:
        fact = "a view needs the package viser, which is not installed"
        raise ViserMissing(f"{fact}; install it: pip install 'palaestra[view]'")


@contextmanager
def viewed(folder: Path, *, opened: bool = False) -> Iterator[None]:
    """Show a run in a separate process, which ends with this process, even if SIGKILL ends this process.

    Args:
        folder: the run directory; the run may start later.
        opened: whether to open the page in a browser, if a display is available.

    Raises:
        ViserMissing: an optional package is not installed.
    """
    require_viser()
    program = "import sys; from palaestra.cli import main; sys.exit(main())"
    words = ["view", str(folder), WITH_STDIN, *([OPENED] if opened else [])]
    command_line = [sys.executable, "-P", "-c", program, *words]
    # In a session of its own, the view gets no signals of the terminal, so it stays until the run has ended.
    with subprocess.Popen(command_line, stdin=subprocess.PIPE, start_new_session=True) as viewer:
        try:
            yield
        finally:
            if viewer.stdin is not None:
                viewer.stdin.close()
            with suppress(subprocess.TimeoutExpired):
                viewer.wait(VIEW_ENDS_S)
            viewer.kill()
