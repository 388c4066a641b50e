"""The success rates of the examples' policies by training seed, on episodes not used to choose a policy."""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

from palaestra_trainer.environments import baselines
from palaestra_trainer.episodes.seeds import episode_seeds
from palaestra_trainer.simulators.entry_point import make
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.jobs import example
from tests.local_run import PALAESTRA

NEW, OLD = "move-to-target", "paper-dqn"
SEEDS = (1, 2, 3, 4, 5)
SPARSE_SEEDS = (1, 2, 3)
NAVIGATE_SEEDS = (1, 2, 3)
EPISODES = 100
LEAST_STEPS = 300
STREAM = "bench"
MOVEMENTS = example("move-to-target")["spec"]["trainer"]["environment"]["options"]["movements"]
EVAL = Path(sys.executable).with_name("palaestra-eval")


def measure(scale=1.0):
    """Return success and training time of move-to-target and paper-dqn by seed, and the ratio of their times.

    The two examples train in turns, so that both have the same load of the machine. Each result also goes to
    standard error, because all seeds take more than half an hour.
    """
    trained = {str(seed): _pair(seed, scale) for seed in SEEDS[: scaled(len(SEEDS), scale)]}
    pairs = trained.values()
    return {
        "seeds": trained,
        "seeds_at_95": sum(pair[NEW]["success"] >= 0.95 for pair in pairs),
        "seconds_share": _share(pairs, "seconds"),
        "processor_share": _share(pairs, "processor_seconds"),
        **measure_baselines(scale),
    }


def measure_navigate(scale=1.0):
    """Return the success rate of navigate by training seed."""
    trained = by_seed("navigate", NAVIGATE_SEEDS, scale)
    return {"success": trained, "seeds_at_90": sum(rate >= 0.9 for rate in trained.values())}


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


def _pair(seed, scale):
    """Return success and seconds of both examples with a training seed."""
    pair = {name: _timed(name, seed, scale) for name in (NEW, OLD)}
    sys.stderr.write(json.dumps({"seed": seed, **pair}) + "\n")
    sys.stderr.flush()
    return pair


def _timed(name, seed, scale):
    """Return the success of an example's policy, and the wall and processor seconds of `palaestra run`."""
    job = shortened(example(name), scale)
    job["spec"]["seed"] = seed
    with tempfile.TemporaryDirectory() as folder:
        started, used = time.monotonic(), _processor_seconds()
        run = train(job, Path(folder))
        seconds, processor = time.monotonic() - started, _processor_seconds() - used
        return {
            "success": success_rate(run, scaled(EPISODES, scale)),
            "seconds": round(seconds, 1),
            "processor_seconds": round(processor, 1),
        }


def _processor_seconds():
    """Return the processor time of all ended processes that this process started."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _share(pairs, name):
    """Return the total time of the trainings of move-to-target, divided by that of paper-dqn."""
    return round(sum(pair[NEW][name] for pair in pairs) / sum(pair[OLD][name] for pair in pairs), 3)


def shortened(job, scale):
    """Return the job; below full scale, it has fewer steps and evaluates only at its end."""
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
