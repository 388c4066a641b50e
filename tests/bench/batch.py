"""The steps per second of many copies in one MuJoCo, compared with one MuJoCo over ROS.

The two are measured in turns, with random actions. A step is one step of the environment of one copy. At full
scale, the part also trains both examples until 95 of 100 episodes succeed, evaluated over ROS.
"""

import json
import statistics
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from palaestra_trainer.episodes.batch_vec_env import BatchVecEnv
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.job.configuration import parse
from palaestra_trainer.simulators.batch_simulator import BatchSimulator
from palaestra_trainer.simulators.connect import simulator_at
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from tests.bench.learning import shortened, train
from tests.bench.sizes import scaled
from tests.jobs import example

ROUNDS = 5
ROWS = 256
BATCH_STEPS = 40
ROS_STEPS = 300
WANTED = {"stopAtSuccessRate": 0.95, "episodes": 50, "confirmEpisodes": 100}


def measure(scale=1.0):
    """Return the steps per second of copies and of ROS, their ratio, and the training times of both examples.

    The ratio is the median over the rounds. A training ends when 95 of 100 episodes succeed.
    """
    rows = scaled(ROWS, scale, 4)
    with ExitStack() as stack:
        batch, single = copies(stack, rows), over_ros(stack)
        pairs = [
            (rate(batch, scaled(BATCH_STEPS, scale)), rate(single, scaled(ROS_STEPS, scale)))
            for _ in range(scaled(ROUNDS, scale))
        ]
    return {
        "rows": rows,
        "steps_per_second": round(statistics.median(many for many, _ in pairs)),
        "ros_steps_per_second": round(statistics.median(one for _, one in pairs)),
        "times_ros": round(statistics.median(many / one for many, one in pairs), 1),
        **seconds_to_learn(scale),
    }


def copies(stack, rows):
    """Return a VecEnv of copies in one simulator."""
    given = configuration(batch=rows)
    launcher = ProcessLauncher("arena", "mujoco", (f"--batch={rows}",))
    stack.callback(launcher.close)
    return begun(stack, BatchVecEnv(started(stack, BatchSimulator(launcher, given, given.simulators[0])), 1))


def over_ros(stack):
    """Return a VecEnv of one simulator over ROS."""
    given = configuration()
    launcher = ProcessLauncher("arena", "mujoco")
    stack.callback(launcher.close)
    member = simulator_at(launcher, given, given.simulators[0])
    return begun(stack, SimulatorsVecEnv([started(stack, member)], 1))


def configuration(**changes):
    """Return a configuration with one collecting MuJoCo."""
    simulator = {"name": "collect-0", "group": "collect", "index": 0, "role": "Collect", "driver": "mujoco"}
    environment = {"id": "MoveToTargetEnv-v0"}
    simulators = [{**simulator, "world": "arena", **changes}]
    return parse({"job": "bench", "environment": environment, "steps": 1, "simulators": simulators})


def started(stack, member):
    """Return the restarter of a member that has started."""
    restarter = Restarter(member)
    restarter.begin_start()
    restarter.under_way and restarter.under_way.result()
    stack.callback(restarter.stop)
    return restarter


def begun(stack, env):
    """Return the VecEnv with episodes that have begun."""
    stack.callback(env.close)
    env.reset()
    return env


def rate(env, steps):
    """Return the steps per second of all rows together, with random actions; drawing them is not timed."""
    random = np.random.default_rng(0)
    actions = random.integers(0, env.action_space.n, (steps, env.num_envs))
    began = time.perf_counter()
    for chosen in actions:
        env.step(chosen)
    return steps * env.num_envs / (time.perf_counter() - began)


def seconds_to_learn(scale):
    """Return for each example the seconds of its training, and the success rate of its policy."""
    found = {}
    for name in ("move-to-target-batch", "move-to-target-mujoco"):
        job = shortened(example(name), scale)
        trainer = job["spec"]["trainer"]
        if scale < 1:
            small(job)
        else:
            trainer["evaluation"] = {**trainer["evaluation"], **WANTED}
        with tempfile.TemporaryDirectory() as folder:
            summary = json.loads((train(job, Path(folder)) / "summary.json").read_text())
        found[name] = {"seconds": summary["duration_s"], "success": summary["success_rate"]}
    return found


def small(job):
    """Make the batch and the rollout of a job small."""
    for group in job["spec"]["simulators"]:
        if "batch" in group:
            group["batch"] = 8
            job["spec"]["trainer"]["algorithm"]["hyperparameters"] |= {"n_steps": 16, "batch_size": 64}
