"""The choice of the robot that a gateway shows, and its refusals."""

import pytest

from palaestra_protocol.control import RobotName
from palaestra_protocol.scene import VisibleNode, VisibleScene
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.simulators.ros2_gateway.gateway import Gateway
from palaestra_trainer.simulators.ros2_gateway.publishing import RobotPublishers
from palaestra_trainer.simulators.ros2_gateway.simulators import (
    RunRobotFinder,
    ShownRobot,
    chosen_robot,
    shown_node,
)
from palaestra_trainer.waiting.check import go_on

TRAINING = """\
job: move
environment: {id: MoveToTargetEnv-v0}
steps: 1
simulators:
- {name: collect-0, group: collect, index: 0, role: Collect}
- {name: evaluate-0, group: evaluate, index: 0, role: Evaluate}
"""


class Undescribed:
    """A simulator that does not describe its world, as Webots; it is also the finder of its robot."""

    def scene(self):
        """Return None."""

    def find(self):
        """Return the robot."""
        return ShownRobot(place="simulator w-0", reader=self, name="a", ros_name="a", master_uri=None)


def scene(*robots):
    """Return a scene with these robots and a can."""
    nodes = [VisibleNode(name=name, robot=True) for name in robots]
    return VisibleScene(world="arena.wbt", revision=1, nodes=(*nodes, VisibleNode(name="CAN")))


def robot(name):
    """Return the names of a robot."""
    return RobotName(robot=name, ros_name=f"job_{name}", supervisor=True)


def test_the_only_robot_needs_no_name():
    """Most worlds have one robot, and its name in ROS ends with a hash, which a person cannot remember."""
    assert chosen_robot([robot("a")], None).robot == "a"
    assert shown_node(scene("a"), "job_a") == "a"


@pytest.mark.parametrize("wanted", ["b", "job_b", "/job_b"])
def test_one_of_several_robots_is_named_as_in_the_world_or_in_ros(wanted):
    """People see both names: one in the page of `palaestra view`, the other in `rosnode list`."""
    assert chosen_robot([robot("a"), robot("b")], wanted).ros_name == "job_b"
    assert shown_node(scene("a", "b"), "b") == "b"


@pytest.mark.parametrize(
    ("wanted", "message"),
    [(None, "has 2 robots with a node of ROS; choose one of a, b"), ("c", "--robot c: .* use one of a, b")],
)
def test_a_refusal_names_the_robots_that_exist(wanted, message):
    """The next command can then be right."""
    with pytest.raises(ConfigurationError, match=message):
        chosen_robot([robot("a"), robot("b")], wanted)
    with pytest.raises(ConfigurationError, match="shows no such robot; it shows a, b"):
        shown_node(scene("a", "b"), "c")


def test_a_folder_without_a_run_and_an_unknown_simulator_are_refused(tmp_path):
    """A gateway would otherwise wait for a simulator that never starts."""
    with pytest.raises(ConfigurationError, match=r"has no training\.yaml; give a run directory"):
        RunRobotFinder(tmp_path).refuse_missing()
    (tmp_path / "training.yaml").write_text(TRAINING)
    with pytest.raises(ConfigurationError, match="no such simulator; use one of collect-0, evaluate-0"):
        RunRobotFinder(tmp_path, "collect-1").refuse_missing()


def test_a_simulator_that_does_not_describe_its_world_is_refused():
    """Webots has no service that returns time and poses of one step together."""
    gateway = Gateway(RobotPublishers(None), go_on, lambda _: None)

    with pytest.raises(ConfigurationError, match="simulator w-0: does not describe its world"):
        gateway.run(Undescribed())
