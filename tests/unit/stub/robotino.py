"""The drive of the Robotino, by the numbers of its own controller, base.c."""

import math

from palaestra_sim.stub.physics.drive import Wheel, find_drive

WHEELS = ("wheel0_joint", "wheel1_joint", "wheel2_joint")
RADIUS_M = 0.063
DISTANCE_M = 0.1826
K = math.sqrt(0.75)

DRIVE = find_drive(
    [
        Wheel(x_m=-DISTANCE_M, y_m=0.0, axle=(-1.0, 0.0), radius_m=RADIUS_M),
        Wheel(x_m=DISTANCE_M / 2, y_m=-DISTANCE_M * K, axle=(0.5, -K), radius_m=RADIUS_M),
        Wheel(x_m=DISTANCE_M / 2, y_m=DISTANCE_M * K, axle=(0.5, K), radius_m=RADIUS_M),
    ]
)


def wheel_speeds(vx, vy, omega):
    """Return the speeds of the three wheels in rad/s."""
    return tuple(DRIVE.wheel_speeds(vx, vy, omega))


def twist(*speeds):
    """Return vx, vy and omega in m/s, m/s and rad/s."""
    return DRIVE.twist(speeds)
