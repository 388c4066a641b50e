"""`palaestra-ros-master` runs a ROS master."""

from __future__ import annotations

import argparse
import ipaddress
import logging
import os
import signal
import sys
import threading
from collections.abc import Sequence

from palaestra_protocol.http import Address
from palaestra_protocol.signals import obeyed, set_at_signals
from palaestra_protocol.xmlrpc.server import host_name
from palaestra_trainer.ros_master.serving import MasterServer

LOOPBACK = "127.0.0.1"
EXIT_WRONG = 2
_DESCRIPTION = """\
A ROS 1 master with its parameters, without any package of ROS.

Prints its URI when it is ready, and ends at SIGTERM or SIGINT.
The master answers every program that can connect, so listen on an address that only your programs can reach.

exit codes: 0 after a signal, or when standard input has closed; 2 a wrong option, or a port in use
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run `palaestra-ros-master` until a signal ends it."""
    options = _options(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    ended = threading.Event()
    set_at_signals(ended, obeyed((signal.SIGTERM, signal.SIGINT, signal.SIGHUP)))
    if options.until_stdin_closes:
        threading.Thread(target=_end_with_owner, daemon=True).start()
    host, port = options.listen
    try:
        master = MasterServer(host, port, _name(host))
    except OSError as error:
        sys.stderr.write(f"--listen: {options.listen}: {error.strerror}; choose another address\n")
        sys.exit(EXIT_WRONG)
    with master:
        sys.stdout.write(f"{master.uri}\n")
        sys.stdout.flush()
        ended.wait()


def _end_with_owner() -> None:
    """End this process when its standard input closes; the kernel closes it when the parent is killed."""
    while os.read(sys.stdin.fileno(), 1024):
        pass
    os._exit(0)  # end at once, and do not wait for the threads of connections


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="palaestra-ros-master",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "--listen",
        type=Address.parse,
        default=Address(LOOPBACK, 0),
        metavar="ADDRESS:PORT",
        help=f"address and port; port 0 takes one that is free; default: {LOOPBACK}:0",
    )
    parser.add_argument(
        "--until-stdin-closes", action="store_true", help="end when the program that started it has ended"
    )
    return parser.parse_args(arguments)


def _name(host: str) -> str:
    """Return the host name by which nodes reach the master; nodes choose their own names in the same way."""
    if host == LOOPBACK:
        return LOOPBACK
    chosen = os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")
    if chosen or ipaddress.ip_address(host).is_unspecified:
        return host_name(os.environ)
    return f"[{host}]" if ":" in host else host
