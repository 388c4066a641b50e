"""A robot, a world and a program of other people, in a pod."""

import pytest

from tests.e2e.namespace import LONG_S
from tests.strangers import DRIVE, rover

pytestmark = [pytest.mark.beside, pytest.mark.timeout(600)]

STOPPED = "stopped at 0[.]4[0-9] -?0[.]00 .* turned by 1[12][0-9] degrees"
SCRIPT = f"""set -o pipefail
python3 - <<'PROGRAM' | tee /dev/stderr | grep -E '{STOPPED}'
{DRIVE}
PROGRAM
"""
ENOUGH = {"requests": {"cpu": "50m", "memory": "160Mi"}}


def test_a_differential_robot_drives_among_boxes_by_its_own_program(namespace, job):
    """An E-puck, as its world names it; the program ends with 0 only where the robot must be by then."""
    simulator = {**rover(), "resources": ENOUGH}
    namespace.apply(
        job("rover", script=SCRIPT, simulator=simulator, trainer={"resources": ENOUGH}, backoffLimit=0)
    )

    assert namespace.wait_for_end("rover", LONG_S) == "Succeeded"
