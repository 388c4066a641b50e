"""A ROS master that lives as long as the program that started it; `python -m` this module with a port.

It ends when its standard input closes, which the kernel sees to even when its owner is killed.
"""

from __future__ import annotations

import logging
import os
import sys
import threading

from rosmaster.master import Master


def main() -> None:
    """Serve on loopback at the port given, until standard input closes."""
    logging.basicConfig(level=logging.ERROR)
    os.environ["ROS_HOSTNAME"] = "localhost"
    master = Master(int(sys.argv[1]))
    master.start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    ended = threading.Thread(target=sys.stdin.read)
    ended.start()
    ended.join()
    master.stop()
    os._exit(0)  # the master's server threads know no end


if __name__ == "__main__":
    main()
