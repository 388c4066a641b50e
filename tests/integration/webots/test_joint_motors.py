"""The limits and the effort of a motor, compared with the world's text and with a lever's formula."""

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots import EffortFeedback, JointMotor, MotorLimits
from tests.integration.webots.own_world import OwnRobot, running
from tests.values.worlds import PHYSICS, Setting, robot

MASS_KG, LEVER_M, G = 2.0, 0.3, 9.81
ARM = f"""HingeJoint {{ jointParameters HingeJointParameters {{ axis 0 1 0 }}
    device RotationalMotor {{ name "arm" minPosition -1 maxPosition 2 maxVelocity 3 maxTorque 40 }}
    endPoint DEF ARM Solid {{ boundingObject Box {{ size 0.1 0.1 0.1 }} translation {LEVER_M} 0 0
      physics Physics {{ density -1 mass {MASS_KG} }} }} }}"""


class Lever(OwnRobot):
    """A robot with a horizontal arm."""

    definition = "R"

    def equip(self):
        """Add the motor."""
        self.arm = JointMotor(self.node_name, "arm", "position")
        self.simulation.add([], [self.arm])


@pytest.fixture(params=PHYSICS)
def lever(request, master, tmp_path):
    """Yield the arm's robot in a running simulator."""
    del master
    with running(
        Setting(request.param).text(robot(ARM, "translation 0 0 1")), tmp_path, request.param, Lever
    ) as (_, found):
        yield found


def test_a_motor_has_the_limits_of_the_world_and_takes_others(lever):
    """A controller scales its commands with these limits, and may set a lower limit of the effort."""
    assert lever.arm.limits == MotorLimits(
        min_position=-1.0, max_position=2.0, max_velocity=3.0, max_effort=40.0
    )
    lever.arm.set(0.5)
    lever.arm.set_acceleration(10.0)
    lever.arm.set_available_effort(40.0)

    assert lever.arm.target_position == 0.5
    with pytest.raises(ConfigurationError, match="arm: the torque 41 is refused; use 0 to 40"):
        lever.arm.set_available_effort(41.0)


def test_the_effort_of_a_motor_that_holds_an_arm_is_that_of_a_lever(master, tmp_path):
    """At rest, the motor's torque balances the weight of the arm."""
    del master

    class Felt(Lever):
        def equip(self):
            super().equip()
            self.effort = EffortFeedback(self.node_name, "arm")
            self.simulation.add([self.effort], [])

    with running(Setting("mujoco").text(robot(ARM, "translation 0 0 1")), tmp_path, "mujoco", Felt) as (
        _,
        felt,
    ):
        felt.arm.set(0.0)
        for _ in range(200):
            felt.advance()
        assert abs(felt.effort.value) == pytest.approx(MASS_KG * G * LEVER_M, rel=0.02)
