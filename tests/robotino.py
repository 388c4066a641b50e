"""The kinematics of the Robotino 3 in closed form, as in the sample controller of Webots.

Source: Webots, projects/robots/festo/robotino3/controllers/robotino3/base.c. Wheel 0 is at the rear, wheel 1
at the front right, and wheel 2 at the front left.
"""

import math

from palaestra_sim.scene.wheel_kinematics import Wheel

WHEELS = ("wheel0_joint", "wheel1_joint", "wheel2_joint")
RADIUS_M = 0.063
DISTANCE_M = 0.1826
K = math.sqrt(0.75)
ROBOTINO = tuple(
    Wheel(x_m=DISTANCE_M * x, y_m=DISTANCE_M * y, axle=(x, y), radius_m=RADIUS_M)
    for x, y in ((-1.0, 0.0), (0.5, -K), (0.5, K))
)


def twist(w0, w1, w2):
    """Return vx, vy in m/s and omega in rad/s from the wheels' speeds in rad/s."""
    return (
        RADIUS_M * (w2 - w1) / (2.0 * K),
        RADIUS_M * (2.0 * w0 - w1 - w2) / 3.0,
        -RADIUS_M * (w0 + w1 + w2) / (3.0 * DISTANCE_M),
    )


def wheel_speeds(vx, vy, omega):
    """Return the wheels' speeds in rad/s for a twist in m/s, m/s, rad/s."""
    turning = DISTANCE_M * omega
    return (
        (vy - turning) / RADIUS_M,
        (-K * vx - 0.5 * vy - turning) / RADIUS_M,
        (K * vx - 0.5 * vy - turning) / RADIUS_M,
    )
