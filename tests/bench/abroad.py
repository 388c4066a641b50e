"""Policies in a simulator in which they were not trained, and policies that observe camera images."""

import shutil
import tempfile
from pathlib import Path

from tests.bench.learning import EPISODES, shortened, success_rate, train
from tests.bench.sizes import scaled
from tests.jobs import example

HOMES = {"mujoco": "move-to-target-mujoco", "stub": "move-to-target"}
CYLINDER_STEPS = 300_000


def measure_transfer(scale=1.0):
    """Return the success rates of two policies for move-to-target, on the same episodes.

    One policy is trained in MuJoCo and the other in the stub. Each policy is measured in both simulators.
    Below full scale, the function measures only the policy that was trained in MuJoCo.
    """
    homes = list(HOMES.items())[: scaled(len(HOMES), scale)]
    with tempfile.TemporaryDirectory() as folder:
        runs = {home: train(shortened(example(name), scale), Path(folder)) for home, name in homes}
        return {
            f"{home}_in_{place}": success_rate(moved(run, home, place), scaled(EPISODES, scale))
            for home, run in runs.items()
            for place in HOMES
        }


def measure_seeing(scale=1.0):
    """Return the success rates of camera policies: on an empty floor, and among cylinders.

    Among cylinders, one policy observes 1 frame and another 3 frames.
    """
    variants = {
        "empty": {},
        "cylinders_1_frame": {"cylinders": True, "frames": 1},
        "cylinders_3_frames": {"cylinders": True, "frames": 3},
    }
    chosen = list(variants.items())[: scaled(len(variants), scale)]
    return {name: _see(scale, **options) for name, options in chosen}


def moved(run, home, place):
    """Return a copy of a run directory whose simulators have the driver `place` instead of `home`."""
    copy = run.parent / f"in-{place}"
    shutil.copytree(run, copy)
    configuration = copy / "training.yaml"
    text = configuration.read_text()
    configuration.write_text(text.replace(f"driver: {home}", f"driver: {place}"))
    return copy


def _see(scale, **options):
    """Return the success rate of see-target's policy; a policy with options trains for more steps."""
    job = example("see-target")
    trainer = job["spec"]["trainer"]
    trainer["environment"]["options"].update(options)
    if options:
        trainer["steps"] = CYLINDER_STEPS
    with tempfile.TemporaryDirectory() as folder:
        return success_rate(train(shortened(job, scale), Path(folder)), scaled(EPISODES, scale))
