"""Policies of one simulator in the other, and policies that see: what MuJoCo changes for learning."""

import shutil
import tempfile
from pathlib import Path

from tests.bench.learning import success_rate, train
from tests.soak.jobs import example

HOMES = {"stub": "move-to-target", "mujoco": "move-to-target-mujoco"}
CYLINDER_STEPS = 300_000


def measure_transfer():
    """Return the success of move-to-target's policies at home and in the other simulator, same episodes."""
    with tempfile.TemporaryDirectory() as folder:
        runs = {home: train(example(name), Path(folder)) for home, name in HOMES.items()}
        return {
            f"{home}_in_{place}": success_rate(_moved(run, home, place))
            for home, run in runs.items()
            for place in HOMES
        }


def measure_seeing():
    """Return the success of policies that see: on an empty floor, and among cylinders by 1 and 3 frames."""
    return {
        "empty": _see(),
        "cylinders_1_frame": _see(cylinders=True, frames=1),
        "cylinders_3_frames": _see(cylinders=True, frames=3),
    }


def _moved(run, home, place):
    """Return a copy of a run directory whose simulators have another driver."""
    copy = run.parent / f"in-{place}"
    shutil.copytree(run, copy)
    configuration = copy / "training.yaml"
    text = configuration.read_text()
    configuration.write_text(text.replace(f"driver: {home}", f"driver: {place}"))
    return copy


def _see(**options):
    """Return the success of see-target's policy; with options, after more steps than without."""
    job = example("see-target")
    trainer = job["spec"]["trainer"]
    trainer["environment"]["options"].update(options)
    if options:
        trainer["steps"] = CYLINDER_STEPS
    with tempfile.TemporaryDirectory() as folder:
        return success_rate(train(job, Path(folder)))
