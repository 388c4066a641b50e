"""Drive an E-puck toward a box until its front sensors detect it, then turn, and print the final pose.

The program reaches the simulator only through its sidecar, as a program of a TrainingJob does.
"""

import math
import sys

from palaestra_trainer import report
from palaestra_trainer.job.configuration import load
from palaestra_trainer.webots import DistanceSensor, Motor, Stepper, Webots
from palaestra_trainer.webots.launching.sidecar import Sidecar

PERIOD_MS = 64
NEAR = 100.0  # a value in the lookup table of ps0 and ps7

(simulator,) = load().simulators
sidecar = Sidecar(simulator.control, simulator.name)
(robot,) = sidecar.first_state(60.0).robots
webots = Webots(robot.ros_name, "rover", launcher=sidecar)
simulation = Stepper([robot.ros_name], webots.supervisor, webots.observer, PERIOD_MS)
front = [DistanceSensor(robot.ros_name, name) for name in ("ps0", "ps7")]
wheels = [Motor(robot.ros_name, f"{side} wheel motor") for side in ("left", "right")]
simulation.add(sensors=front, motors=wheels)
simulation.track("ROVER")
webots.at_start("rover", simulation.connect)


def turn_wheels(left: float, right: float) -> None:
    """Set the speeds of both wheels in rad/s."""
    for motor, speed in zip(wheels, (left, right), strict=True):
        motor.set_velocity(speed)


with webots:
    steps = 0
    simulation.step()
    turn_wheels(5.0, 5.0)
    while max(sensor.value for sensor in front) < NEAR and steps < 400:
        simulation.step()
        steps += 1
    x, y, _ = simulation.pose("ROVER")
    turn_wheels(-2.0, 2.0)
    for _ in range(20):
        simulation.step()
    heading = simulation.pose("ROVER")[2]
report(step=steps)
turned = math.degrees(heading)
sys.stdout.write(f"stopped at {x:.2f} {y:.2f} after {steps} steps, turned by {turned:.0f} degrees\n")
simulation.close()
webots.stop()
webots.close()
