"""What the examples learn, by training seed, measured on episodes that nothing was chosen on."""

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
from tests.local_run import PALAESTRA
from tests.soak.jobs import example

SEEDS = (1, 2, 3, 4, 5)
SPARSE_SEEDS = (1, 2, 3)
NAVIGATE_SEEDS = (1, 2, 3)
EPISODES = 100
STREAM = "bench"
MOVEMENTS = example("move-to-target")["spec"]["trainer"]["environment"]["options"]["movements"]
EVAL = Path(sys.executable).with_name("palaestra-eval")


def measure():
    """Return what move-to-target and navigate learn, by seed, and two policies that learn nothing."""
    trained = {str(seed): train_and_measure("move-to-target", seed) for seed in SEEDS}
    navigating = {str(seed): train_and_measure("navigate", seed) for seed in NAVIGATE_SEEDS}
    return {
        "success": trained,
        "seeds_at_95": sum(rate >= 0.95 for rate in trained.values()),
        "navigate": navigating,
        "navigate_seeds_at_90": sum(rate >= 0.9 for rate in navigating.values()),
        **measure_baselines(),
    }


def measure_sparse():
    """Return what sparse-reward learns with each training seed."""
    trained = {str(seed): train_and_measure("sparse-reward", seed) for seed in SPARSE_SEEDS}
    return {"success": trained, "seeds_at_50": sum(rate >= 0.5 for rate in trained.values())}


def train_and_measure(name, seed):
    """Return the success rate, on fresh episodes, of the policy that an example trains with `seed`."""
    job = example(name)
    job["spec"]["seed"] = seed
    with tempfile.TemporaryDirectory() as folder:
        return success_rate(train(job, Path(folder)))


def train(job, folder):
    """Return the directory, inside `folder`, of the finished run of a job."""
    file = folder / "job.yaml"
    file.write_text(yaml.safe_dump(job))
    subprocess.run(
        [PALAESTRA, "run", file, "--dir", folder],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    return folder / job["metadata"]["name"] / "0"


def success_rate(run):
    """Return the success rate of the policy of a run directory, on fresh episodes."""
    result = subprocess.run(
        [EVAL, run, f"--episodes={EPISODES}", f"--seeds={STREAM}"], check=True, capture_output=True, text=True
    )
    return json.loads(result.stdout)["success_rate"]


def measure_baselines():
    """Return the success rates of chance and of driving straight at the target, on such episodes."""
    with running() as (robot, scene, _):
        env = make(robot, scene, movements=MOVEMENTS)
        return {
            name: baselines.success_rate(env, policy, episode_seeds(SEEDS[0], STREAM, EPISODES))
            for name, policy in baselines.BASELINES.items()
        }
