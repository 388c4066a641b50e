"""`palaestra view`: show the simulators of a run in a browser."""

import argparse
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from palaestra.cli.cluster import REFUSED, add_cluster, connected, say
from palaestra.cli.subcommands import WRONG_INPUT, Commands, command
from palaestra.client import Client
from palaestra.live_view.cluster_job import ClusterJob
from palaestra.live_view.local_run import LocalRun, NoRun
from palaestra.live_view.source import NotNow, NotShown, SidecarSource
from palaestra.live_view.view_process import OPENED, WITH_STDIN, require_viser
from palaestra_protocol.numbers import MOST_PORT, whole

PORT = 8080
FIRST_S = 300.0  # longest wait for a run to write the addresses of its simulators
POLL_S = 0.2
VIEW = """\
Shows the simulators of a running training in a browser: the world, the robots, and the state of the episode.
Prints the address of the page, which only this machine can open. Ctrl-C ends the view, and the training
continues. RUN is a folder of this machine, or the name of a job in a cluster. The sidecars of a job are read
through the API server, which needs the right `get` on pods/proxy. Needs the optional package viser.
"""
EXIT_CODES = """\
exit codes:
  0    ended by Ctrl-C
  1    the simulator describes no world, or the cluster has no such job or refused
  2    no such run or simulator, or viser is missing; nothing was started
"""
# If none of these variables is set, `webbrowser` may start a text browser in this terminal.
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "view", _view, VIEW, EXIT_CODES)
    parser.add_argument("run", metavar="RUN", help="run directory, such as runs/JOB/0, or name of a job")
    parser.add_argument(
        "--simulator", metavar="NAME", help="simulator that is shown first; default: the first"
    )
    parser.add_argument(
        "--replica", metavar="N", type=whole(), default=0, help="replica of a job in a cluster; default: 0"
    )
    parser.add_argument(
        "--port",
        metavar="PORT",
        type=whole(0, MOST_PORT),
        default=PORT,
        help="port of the page; default: 8080",
    )
    for hidden in (WITH_STDIN, OPENED):
        parser.add_argument(hidden, action="store_true", help=argparse.SUPPRESS)
    add_cluster(parser)


def _view(options: argparse.Namespace) -> int:
    require_viser()
    folder = Path(options.run)
    if folder.is_dir() or os.sep in options.run or options.until_stdin_closes:
        return _shown(options, _local(options, folder))
    say([f"{options.run}: is not a folder here; looking for a job of this name in the cluster"])
    return connected(_of_cluster)(options)


def _of_cluster(client: Client, options: argparse.Namespace) -> int:
    return _shown(options, ClusterJob(client, options.run, options.replica).sources)


def _local(options: argparse.Namespace, folder: Path) -> Callable[[], Sequence[SidecarSource]]:
    """Return a function that lists the simulators of a run; wait first if the run is just starting.

    Raises:
        NoRun: the folder has no run with simulators.
    """
    give_up = time.monotonic() + (FIRST_S if options.until_stdin_closes else 0.0)
    while True:
        try:
            return LocalRun(folder).sources
        except NoRun:
            if time.monotonic() >= give_up:
                raise
        time.sleep(POLL_S)


def _shown(options: argparse.Namespace, sources: Callable[[], Sequence[SidecarSource]]) -> int:
    """Serve the page until the view ends, and return the exit code."""
    found = {source.name: source for source in sources()}
    if options.simulator is not None and options.simulator not in found:
        say(
            [f"--simulator {options.simulator}: the run has no such simulator; use one of {', '.join(found)}"]
        )
        return WRONG_INPUT
    try:
        with suppress(NotNow):  # the simulator may start later
            found[options.simulator or next(iter(found))].scene()
    except NotShown as error:
        say([str(error)])
        return REFUSED
    # The import is here because viser is optional, and slow to import.
    page = import_module("palaestra.live_view.page").ViewPage(
        options.run, sources, options.port, options.simulator
    )
    end = (
        "it ends with the run"
        if options.until_stdin_closes
        else "Ctrl-C ends the view, and the run continues"
    )
    say([f"{page.address} shows {options.run}; {end}"])
    if options.open_browser and any(os.environ.get(name) for name in DISPLAYS):
        webbrowser.open(page.address)
    try:
        page.run(_ended(by_stdin=options.until_stdin_closes))
    except KeyboardInterrupt:
        return 0
    finally:
        page.close()
    return 0


def _ended(*, by_stdin: bool) -> Callable[[], bool]:
    """Return a function that returns whether the view must end.

    With `by_stdin`, the view must end when its standard input closes; otherwise the result is always False.
    """
    if not by_stdin:
        return lambda: False
    closed = threading.Event()

    def read(stdin: Any) -> None:
        while stdin.read(1):
            pass
        closed.set()

    threading.Thread(target=read, args=(sys.stdin.buffer,), daemon=True).start()
    return closed.is_set
