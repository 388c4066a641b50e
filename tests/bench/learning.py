"""What move-to-target learns: five training seeds, measured on episodes that nothing was chosen on."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml

from palaestra_trainer.environments import baselines
from palaestra_trainer.environments.move_to_target import make
from palaestra_trainer.seeds import episode_seeds
from tests.bench.arena import running
from tests.local_run import PALAESTRA
from tests.soak.jobs import example

SEEDS = (1, 2, 3, 4, 5)
EPISODES = 100
STREAM = "bench"
MOVEMENTS = example("move-to-target")["spec"]["trainer"]["environment"]["options"]["movements"]
EVAL = Path(sys.executable).with_name("palaestra-eval")


def measure():
    """Return the success of each training seed on fresh episodes, and of two policies that learn nothing."""
    trained = {str(seed): train_and_measure(seed) for seed in SEEDS}
    return {
        "success": trained,
        "seeds_at_95": sum(rate >= 0.95 for rate in trained.values()),
        **measure_baselines(),
    }


def train_and_measure(seed):
    """Return the success rate, on seeds that nothing was chosen on, of a policy trained with `seed`."""
    with tempfile.TemporaryDirectory() as folder:
        job = example("move-to-target")
        job["spec"]["seed"] = seed
        file = Path(folder) / "job.yaml"
        file.write_text(yaml.safe_dump(job))
        subprocess.run(
            [PALAESTRA, "run", file, "--dir", folder],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        result = subprocess.run(
            [EVAL, Path(folder) / "move-to-target/0", f"--episodes={EPISODES}", f"--seeds={STREAM}"],
            check=True,
            capture_output=True,
            text=True,
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
