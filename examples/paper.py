"""The two listings of the paper's training session, in their order; Stable-Baselines3 replaces tf-agents.

If a simulator breaks in `webots.run` or `with webots`, it is restarted at once, and its episode is truncated.
"""

import rospy
from stable_baselines3 import DQN
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

from palaestra_trainer import make_env
from palaestra_trainer.webots import Webots
from palaestra_trainer.webots.launching.master import ensure_master

STEPS = 200
supervisor_ros_node_name, world_path = "robotino", "arena"  # a world that ships, or a path

ensure_master()  # without a ROS master, `init_node` waits forever

# create the agent ros node
rospy.init_node("RobotinoAgent", anonymous=False)
# create the webots facade
webots = Webots(supervisor_ros_node_name, world_path)
# create the environment, which uses that facade
env_options = {"max_steps": 50}
env = Monitor(make_env("MoveToTargetEnv-v0", **env_options))
# reset the environment
observation, info = webots.run(lambda: env.reset(seed=1))

model = DQN("MlpPolicy", env, learning_starts=50, seed=1)


# collect experience with callback function
def collect_experience() -> None:
    """Learn from some steps."""
    model.learn(STEPS)


webots.run(collect_experience)

# evaluate policy with context manager
with webots:
    mean_return, _ = evaluate_policy(model, env, n_eval_episodes=2)
print(f"done: {model.num_timesteps} steps, mean return {mean_return:.2f}")

env.close()
webots.stop()
webots.close()
