"""docs/reference/paper.md names classes and methods that exist, and none of the paper's is missing."""

import re
from pathlib import Path
from pkgutil import resolve_name

from tests.tables import for_each

PAGE = (Path(__file__).parents[2] / "docs/reference/paper.md").read_text()
NAMED = sorted(set(re.findall(r"`(palaestra_trainer\.[\w.]+)`", PAGE)))
# The classes of the paper's figures, and the methods of its listings.
OF_THE_PAPER = (
    "Webots(supervisor_node_name, world_path)",
    "start()", "stop()", "webots()", "available()", "run(callback, restart=False)", "with webots:",
    "RosService", "RosSubscriber", "Observer", "Supervisor", "Sensor", "TouchSensor", "DistanceSensor",
    "Camera", "Motor", "RobotinoAbc", "Robotino", 'rospy.init_node("RobotinoAgent")',
    'suite_gym.load("MoveToTargetEnv-v0")', "dqn", "reinforce",
)  # fmt: skip


@for_each("name", NAMED)
def test_every_name_on_the_page_can_be_imported(name):
    """A reader copies these names into a program."""
    package, _, path = name.rpartition(".")
    while True:
        try:
            resolve_name(f"{package}:{path}")
        except ModuleNotFoundError:
            package, _, last = package.rpartition(".")
            path = f"{last}.{path}"
        else:
            return


def test_no_class_or_method_of_the_paper_is_missing():
    """A reader of the paper looks up its classes and methods in the first column of the page's table."""
    rows = " ".join(line.split("|")[1] for line in PAGE.splitlines() if line.startswith("| "))
    words = {*re.findall(r"[\w-]+", re.sub(r"`[^`]+`", "", rows)), *re.findall(r"`([^`]+)`", rows)}

    assert [each for each in OF_THE_PAPER if each not in words] == []
