"""A ROS master that ends with the program that started it; `python -m` this module.

It takes a free port and prints its URI. It ends when its standard input closes; the kernel closes it even
when the owner is killed.
"""

from __future__ import annotations

import logging
import os
import sys
import threading

from rosmaster.master import Master


def main() -> None:
    """Serve on loopback until standard input closes."""
    logging.basicConfig(level=logging.ERROR)
    os.environ["ROS_HOSTNAME"] = "localhost"
    # The thread starts before the master, because rosmaster waits for its own server without a timeout.
    owned = threading.Thread(target=_end_with_owner)
    owned.start()
    master = Master(0)
    master.start()
    sys.stdout.write(f"{master.uri}\n")
    sys.stdout.flush()
    owned.join()


def _end_with_owner() -> None:
    sys.stdin.read()
    os._exit(0)  # the master's server threads never end


if __name__ == "__main__":
    main()
