"""A step of move-to-target over ROS by five clients in turns: bytes, two rospy programs, and two of ours.

Each client sends three wheel commands, one time_step and two requests for the pose, and reads ten sensors.
`raw` and `environment` are `floor` and `environment` of `step_floor`. `rospy_persistent` keeps a connection
for each service; `rospy` opens a connection for each call, as a `ServiceProxy` does by default.
"""

import statistics

from tests.bench import step_floor
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.bench.stepping import RospyStepper

ROUNDS = 10
STEPS = 300
SLOW_STEPS = 60  # for the client `rospy`, which is slow because it opens a connection for each call


class Rospy:
    """A program that uses rospy; before it connects, the robot enables its sensors."""

    def __init__(self, robot, *, persistent):
        self._robot = robot
        self._persistent = persistent

    def begin(self):
        """Connect, and return the function that steps."""
        self._robot.connect()
        self._robot.close()
        self._stepper = RospyStepper(self._robot.node_name, persistent=self._persistent)
        return self._stepper.step

    def end(self):
        """Disconnect."""
        self._stepper.close()


def measure(scale=1.0):
    """Return the figures of each client, and the medians of the rounds' ratios to `robot`."""
    with running() as (robot, scene, _):
        clients = {
            "raw": step_floor.Raw(robot),
            "robot": step_floor.Facade(robot),
            "environment": step_floor.Vector(robot, scene),
            "rospy_persistent": Rospy(robot, persistent=True),
            "rospy": Rospy(robot, persistent=False),
        }
        pid = step_floor.simulator()
        steps = {name: scaled(SLOW_STEPS if name == "rospy" else STEPS, scale) for name in clients}
        rounds = [
            {name: step_floor.Phase(client, pid, steps[name]) for name, client in clients.items()}
            for _ in range(scaled(ROUNDS, scale))
        ]
    return {name: compared(rounds, name) for name in clients}


def compared(rounds, name):
    """Return median and p99 of a client's step times in us, and their ratio to the step times of `robot`."""
    found = step_floor.figures([phases[name] for phases in rounds])
    ratios = [phases[name].median_s / phases["robot"].median_s for phases in rounds]
    return {
        "median_us": found["median_us"],
        "p99_us": found["p99_us"],
        "times_robot": round(statistics.median(ratios), 2),
    }
