"""The success rates of the examples' policies by training seed, on episodes that chose no policy."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml

from palaestra_trainer.environments import baselines
from palaestra_trainer.episodes.seeds import episode_seeds
from palaestra_trainer.simulators.entry_point import make
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.jobs import example
from tests.local_run import PALAESTRA

SEEDS = (1, 2, 3, 4, 5)
SPARSE_SEEDS = (1, 2, 3)
NAVIGATE_SEEDS = (1, 2, 3)
EPISODES = 100
LEAST_STEPS = 300
STREAM = "bench"
MOVEMENTS = example("move-to-target")["spec"]["trainer"]["environment"]["options"]["movements"]
EVAL = Path(sys.executable).with_name("palaestra-eval")


def measure(scale=1.0):
    """Return the success rates of both tasks by seed, and of two policies without training."""
    trained = by_seed("move-to-target", SEEDS, scale)
    navigating = by_seed("navigate", NAVIGATE_SEEDS, scale)
    return {
        "success": trained,
        "seeds_at_95": sum(rate >= 0.95 for rate in trained.values()),
        "navigate": navigating,
        "navigate_seeds_at_90": sum(rate >= 0.9 for rate in navigating.values()),
        **measure_baselines(scale),
    }


def measure_sparse(scale=1.0):
    """Return the success rate of sparse-reward by training seed."""
    trained = by_seed("sparse-reward", SPARSE_SEEDS, scale)
    return {"success": trained, "seeds_at_50": sum(rate >= 0.5 for rate in trained.values())}


def by_seed(name, seeds, scale):
    """Return the success rate of an example's policy by training seed.

    Below full scale, only the first seeds are used.
    """
    return {str(seed): train_and_measure(name, seed, scale) for seed in seeds[: scaled(len(seeds), scale)]}


def train_and_measure(name, seed, scale=1.0):
    """Return the success rate, on fresh episodes, of the policy that an example trains with `seed`."""
    job = shortened(example(name), scale)
    job["spec"]["seed"] = seed
    with tempfile.TemporaryDirectory() as folder:
        return success_rate(train(job, Path(folder)), scaled(EPISODES, scale))


def shortened(job, scale):
    """Return a job with a share of its steps; below full scale, the job evaluates only at its end."""
    if scale < 1:
        trainer = job["spec"]["trainer"]
        trainer["steps"] = scaled(trainer["steps"], scale, LEAST_STEPS)
        few = {"everySteps": trainer["steps"], "episodes": 2, "confirmEpisodes": 1}
        trainer["evaluation"] = {**trainer.get("evaluation", {}), **few}
    return job


def train(job, folder):
    """Run a job in `folder`, and return the directory of the finished run."""
    file = folder / "job.yaml"
    file.write_text(yaml.safe_dump(job))
    subprocess.run(
        [PALAESTRA, "run", file, "--dir", folder],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return folder / job["metadata"]["name"] / "0"


def success_rate(run, episodes=EPISODES):
    """Return the success rate, on fresh episodes, of a run's policy."""
    command = [EVAL, run, f"--episodes={episodes}", f"--seeds={STREAM}"]
    result = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(result.stdout)["success_rate"]


def measure_baselines(scale=1.0):
    """Return the success rates of two untrained policies on the same episodes.

    The first policy drives at random, and the second one straight to the target.
    """
    with running() as (robot, scene, _):
        env = make(robot, scene, movements=MOVEMENTS)
        seeds = list(episode_seeds(SEEDS[0], STREAM, scaled(EPISODES, scale)))
        return {
            name: baselines.success_rate(env, policy, seeds) for name, policy in baselines.BASELINES.items()
        }
