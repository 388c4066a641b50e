"""A robot and a computer with addresses of their own in a network namespace, whose network can be cut.

ROS nodes send their own addresses to each other and then connect directly, so a proxy cannot cut them off. In
a namespace, the test can remove both addresses: then no packet arrives, and no connection is closed. The
loopback addresses stay, so a client can still read the pose of the mock robot.

`python -m tests.cut_network` cuts the network of a robot with the ROS 1 driver while a program drives it, and
prints the robot's seconds from its last command until it stands.
"""

import os
import subprocess
import sys
from functools import cache

from tests.dead_man import driver, ros_master, standing_s
from tests.mock_robots import ended, started
from tests.waiting import eventually

ROBOT, COMPUTER = "198.18.42.1", "198.18.42.2"  # addresses for tests of networks
LIMIT_S = 0.4  # longer than the limit over REST, because the driver's loop delays a command by up to 33 ms
DEADLINE_S = 100.0
SEPARATE = ("unshare", "--user", "--map-root-user", "--net")


@cache
def lack():
    """Return the reason for which network namespaces fail here; None if they work."""
    try:
        done = subprocess.run([*SEPARATE, "ip", "link", "set", "lo", "up"], capture_output=True, check=False)
    except OSError:
        return "unshare is not installed"
    return f"{done.stderr.decode().strip()} in a network namespace" if done.returncode else None


def after_cut_s():
    """Return the robot's seconds from its last command until it stands, after a cut over ROS 1."""
    command = [*SEPARATE, sys.executable, "-m", "tests.cut_network"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=DEADLINE_S)
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def main():
    """Measure once, within a namespace of its own."""
    ip("link", "set", "lo", "up")
    for address in (ROBOT, COMPUTER):
        ip("address", "add", f"{address}/32", "dev", "lo")
    os.environ.pop("ROS_HOSTNAME", None)
    os.environ["ROS_IP"] = ROBOT
    with ros_master(f"{ROBOT}:0") as master:
        process, client = started("--drift=0", "--ros1", "--max-speed=0.5", ROS_MASTER_URI=master)
        os.environ["ROS_IP"] = COMPUTER
        try:
            with driver(master.replace("http://", "ros1://").rstrip("/")):
                cut(client)
                sys.stdout.write(f"{standing_s(client)}\n")
        finally:
            ended(process, client)


def cut(client):
    """Remove both addresses while the robot drives; no command arrives after that."""
    before = client.get("/mock/truth")["commands"]
    eventually(lambda: client.get("/mock/truth")["commands"] > before, pace_s=0.005)  # the program drives it
    for address in (ROBOT, COMPUTER):
        ip("address", "delete", f"{address}/32", "dev", "lo")


def ip(*words):
    """Change the network of this namespace."""
    subprocess.run(["ip", *words], check=True, capture_output=True)


if __name__ == "__main__":
    main()
