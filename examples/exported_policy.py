"""Drive a simulated Robotino with the file of `palaestra export RUN --to onnx`, without PyTorch."""

import json
import sys

import gymnasium
import onnxruntime

from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Webots

policy = onnxruntime.InferenceSession(sys.argv[1])
sheet = json.loads(policy.get_modelmeta().custom_metadata_map["palaestra"])
task = f"palaestra_trainer.environments:{sheet['environment']['id']}"
over = False
with Webots("robotino", "arena") as webots:  # starts the simulator, and a ROS master if none runs
    robot = Robotino(webots)
    robot.connect()
    scene = SimulatedScene(webots, robot)
    env = gymnasium.make(task, robot=robot, scene=scene, **sheet["environment"]["options"])
    observation, _ = env.reset(seed=1)
    while not over:
        (actions,) = policy.run(["action"], {"observation": observation[None]})
        observation, _, terminated, truncated, info = env.step(actions[0])
        over = terminated or truncated
    print(info["outcome"], *robot.distances())
webots.stop()
