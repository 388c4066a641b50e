"""Show a run of this program: run `palaestra view` in a separate process.

This module imports neither viser nor the cluster's client, so a run without a page does not need their time
and memory.
"""

import selectors
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Self

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
    viewer = _viewer(folder, *([OPENED] if opened else []))
    try:
        yield
    finally:
        _end(viewer)


class RunView:
    """A page that shows a run, as `palaestra view` does; a notebook shows the page in its cell.

    The page ends with `close`, with a `with` block, or with this program, even if it is killed. Only a
    browser on this machine can open the page.

    Attributes:
        url: the address of the page.
    """

    def __init__(self, url: str, viewer: "subprocess.Popen[bytes]", height: int) -> None:
        self.url = url
        self._viewer = viewer
        self._height = height

    def __enter__(self) -> Self:
        """Return the view."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the page."""
        self.close()

    def close(self) -> None:
        """End the page; further calls have no effect."""
        _end(self._viewer)

    def _repr_html_(self) -> str:
        """Return the page as an element of HTML, which notebooks show."""
        return f'<iframe src="{escape(self.url)}" width="100%" height="{self._height}"></iframe>'


def show(run: Path | str, *, height: int = 480, deadline_s: float = 120.0) -> RunView:
    """Show the simulators of a run of this machine in a page.

    Args:
        run: the run directory; the run may start later.
        height: height of the page in a notebook, in pixels.
        deadline_s: the longest time until the run has simulators.

    Raises:
        ViserMissing: an optional package is not installed.
        ViewError: the run cannot be shown, or has no simulators in time.
    """
    require_viser()
    viewer = _viewer(Path(run), "--port=0", pipe=subprocess.PIPE)
    with ExitStack() as undo:
        undo.callback(_drop, viewer.stdout)
        undo.callback(_end, viewer)
        line = _first_line(viewer, deadline_s)
        url, _, shown = line.partition(" shows ")
        if not shown:
            raise ViewError(line.strip() or f"{run}: the page did not start within {deadline_s:g} s")
        undo.pop_all()
    threading.Thread(target=_drop, args=(viewer.stdout,), daemon=True).start()
    return RunView(url, viewer, height)


def _viewer(folder: Path, *options: str, pipe: int | None = None) -> "subprocess.Popen[bytes]":
    """Start the view in a process that ends when its standard input closes."""
    program = "import sys; from palaestra.cli import main; sys.exit(main())"
    command_line = [sys.executable, "-P", "-c", program, "view", str(folder), WITH_STDIN, *options]
    # In a session of its own, the view gets no signals of the terminal, so it stays until the run has ended.
    return subprocess.Popen(
        command_line,
        stdin=subprocess.PIPE,
        stdout=pipe,
        stderr=None if pipe is None else subprocess.STDOUT,
        start_new_session=True,
    )


def _end(viewer: "subprocess.Popen[bytes]") -> None:
    if viewer.stdin is not None:
        viewer.stdin.close()
    with suppress(subprocess.TimeoutExpired):
        viewer.wait(VIEW_ENDS_S)
    viewer.kill()
    viewer.wait()


def _first_line(viewer: "subprocess.Popen[bytes]", deadline_s: float) -> str:
    """Return the first line of the view's output; return "" if no line arrives within `deadline_s`."""
    if viewer.stdout is None:
        raise ValueError("the view was started without a pipe for its output")
    with selectors.DefaultSelector() as selector:
        selector.register(viewer.stdout, selectors.EVENT_READ)
        if not selector.select(deadline_s):
            return ""
    return viewer.stdout.readline().decode(errors="replace")


def _drop(pipe: IO[bytes] | None) -> None:
    """Read and drop the output of the view until it ends, because a full pipe would block the view."""
    if pipe is not None:
        with pipe:
            while pipe.read(65536):
                pass
