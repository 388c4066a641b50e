"""Drive a simulated Robotino and read its sensors, in a script or in the cells of a notebook."""

from palaestra_trainer.robots import Movement, Pose
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Webots

with Webots("robotino", "arena") as webots:  # starts the simulator, and a ROS master if none runs
    robot = Robotino(webots)
    robot.connect()
    SimulatedScene(webots, robot).reset(seed=1, start=Pose(-1.5, 0.0, 0.0), target=(1.0, 0.0))
    robot.move(Movement.FORWARD)
    for _ in range(16):  # control periods of 192 ms
        robot.advance()
    print(robot.pose(), "bumped" if robot.bumped() else "free", *robot.distances())
webots.stop()
