"""`palaestra run`, and a script with a facade, run in a file system without packages of ROS."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests import without_ros
from tests.jobs import make_job

PALAESTRA = Path(sys.executable).with_name("palaestra")
DEADLINE_S = 240.0  # the work takes ten seconds on an idle machine
MODULES = ("rospy", "rosmaster", "rosgraph", "genpy", "std_msgs", "netifaces")
JOB = make_job(
    "bare",
    simulators=[{"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}],
    trainer={
        "environment": {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 20}},
        "algorithm": {"name": "A2C", "hyperparameters": {"n_steps": 20}},
        "steps": 100,
        "evaluation": {"everySteps": 100, "episodes": 1, "confirmEpisodes": 1},
    },
)
# A user's program, which is a ROS node itself and starts a master.
PROGRAM = f"""
import importlib.util, os, xmlrpc.client
print([name for name in {MODULES} if importlib.util.find_spec(name)])
from palaestra_trainer.ros import ensure_node
from palaestra_trainer.ros.node import node_uri
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.webots import Webots
webots = Webots("robotino", "arena")
robot = Robotino(webots)
with webots:
    robot.drive(0.1, 0.0, 0.0)
    robot.advance()
    print(len(robot.distances()))
    master, node = (xmlrpc.client.ServerProxy(uri) for uri in (os.environ["ROS_MASTER_URI"], node_uri()))
    print(node.getPid("/test")[2] == os.getpid(), node.getMasterUri("/test")[2] == master.getUri("/test")[2])
    subscribed = master.getSystemState("/test")[2][1]
    print([nodes for topic, nodes in subscribed if topic == "/robotino/ir1/value"] == [[ensure_node()]])
"""


@pytest.fixture
def bare(tmp_path):
    """Return a function that runs a command without ROS and returns exit code and output."""
    if not without_ros.works(tmp_path):
        pytest.skip("this machine lets nobody lay a file system over /usr in a namespace")

    def run(*words):
        done = subprocess.run(
            without_ros.command(words, tmp_path),
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=DEADLINE_S,
            check=False,
        )
        return done.returncode, done.stdout

    return run


def test_a_job_is_trained_where_no_ros_is_installed(bare, tmp_path):
    """A user can train on a machine without a distribution's packages of ROS."""
    job = tmp_path / "job.yaml"
    job.write_text(yaml.safe_dump(JOB))

    code, output = bare(PALAESTRA, "run", job)

    assert code == 0, output
    assert json.loads((tmp_path / "runs/bare/0/summary.json").read_text())["steps"] == 100
    assert (tmp_path / "runs/bare/0/model.zip").exists()


def test_a_facade_starts_its_simulator_where_no_ros_is_installed(bare):
    """A notebook or script has no runner, so the facade must start the ROS master."""
    code, output = bare(sys.executable, "-c", PROGRAM)

    assert code == 0, output
    assert output.splitlines() == ["[]", "9", "True True", "True"]
