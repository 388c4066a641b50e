"""A simulator with the built-in arena and the facades that control it, for measurements."""

from contextlib import contextmanager

from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Mode, Webots
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher


@contextmanager
def running(*options, world="arena", name="robotino", driver="stub"):
    """Yield a connected robot, its scene and its launcher."""
    launcher = ProcessLauncher(world, driver, options)
    webots = Webots(name, world, launcher=launcher)
    webots.start()
    webots.supervisor.set_mode(Mode.FAST)
    robot = Robotino(webots)
    robot.connect()
    try:
        yield robot, SimulatedScene(webots, robot), launcher
    finally:
        robot.close()
        webots.stop()
        webots.close()
        launcher.close()
