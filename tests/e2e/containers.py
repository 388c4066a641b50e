"""Simulators in containers of a real Docker Engine: python -m tests.e2e.containers.

The program starts simulators in both kinds of networks, kills programs that own a simulator, and prints its
observations as JSON. It runs in the network of the engine (tests/cluster/beside_containers.sh).
"""

import json
import os
import subprocess
import sys

import docker

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots import Docker, Webots
from tests.waiting import eventually

ENDS_S = 60
OWN = {"label": "palaestra.launcher"}
OWNER = """
import sys
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.webots import Docker, Webots
webots = Webots("robotino", "arena", launcher=Docker(network=sys.argv[1]))
with webots:
    robot = Robotino(webots)
    robot.connect()
    robot.advance()
    print(webots.observer.time(), flush=True)
sys.stdin.read()
"""


def main() -> None:
    """Print the simulated time in each network, the names of two simulators of one world, and more.

    The other values are the error for a container with a GPU, and the containers that still exist at the end.
    """
    engine = docker.from_env()

    def left() -> list[str]:
        return [
            container.name for container in engine.containers.list(all=True, ignore_removed=True, filters=OWN)
        ]

    seen = {"times": [_of_a_killed_program(network, left) for network in ("bridge", "host")]}
    with Webots("robotino", "arena", launcher="docker") as first:
        second = Webots("robotino", "arena", launcher="docker")
        seen["names"] = [first.robot_name, second.robot_name]
        second.close()
    first.close()
    try:
        Webots("robotino", "arena", launcher=Docker(gpus=1))
    except ConfigurationError as error:
        seen["refusal"] = str(error)
    seen["left"] = left()
    sys.stdout.write(json.dumps(seen))


def _of_a_killed_program(network: str, left) -> float:
    """Return the simulated time after a step of a program.

    The program is then killed, and its container must end.
    """
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER, network],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    time_s = float(owner.stdout.readline())
    assert len(left()) == 1
    owner.kill()
    owner.communicate()
    assert eventually(lambda: not left(), ENDS_S)
    return time_s


if __name__ == "__main__":
    main()
