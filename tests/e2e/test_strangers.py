"""A pod runs a robot, a world and a program that Palaestra did not provide."""

import pytest

from tests.e2e.namespace import LONG_S
from tests.strangers import DRIVE, rover

pytestmark = [pytest.mark.beside, pytest.mark.timeout(1200)]

STOPPED = "stopped at 0[.]4[0-9] -?0[.]00 .* turned by 1[12][0-9] degrees"
SCRIPT = 'said=$(python3 -c "$PROGRAM") || exit; echo "$said"; grep -qE "$STOPPED" <<<"$said"'
ENOUGH = {"requests": {"cpu": "50m", "memory": "160Mi"}}


def test_a_differential_robot_drives_among_boxes_by_its_own_program(namespace, job):
    """The robot is an E-puck, and the job's own program drives it instead of a trainer.

    The program exits with 0 only if the robot has reached its goal.
    """
    made = job("rover", script=SCRIPT, simulator=rover(), backoffLimit=0)
    made["spec"]["simulators"][0]["resources"] = ENOUGH
    made["spec"]["trainer"] |= {
        "resources": ENOUGH,
        "env": [{"name": "PROGRAM", "value": DRIVE}, {"name": "STOPPED", "value": STOPPED}],
    }
    namespace.apply(made)

    assert namespace.wait_for_end("rover", LONG_S) == "Succeeded"
