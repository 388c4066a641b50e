"""Jobs with `driver: mujoco`: two trainings, and an image that renders in a pod."""

import io
import zipfile

import pytest
import torch

from tests.e2e.jobs import WAIT
from tests.e2e.namespace import LONG_S
from tests.e2e.test_tools import typed
from tests.jobs import example

pytestmark = pytest.mark.timeout(900)

# The steps are slow, so that the simulator still runs when a test reads its environment.
SLOW = [{"name": "PALAESTRA_STUB_FAULTS", "value": "slow:latency_ms=40"}]
SIMULATORS = [
    {"name": "collect", "role": "Collect", "driver": "mujoco", "env": SLOW},
    {"name": "evaluate", "role": "Evaluate", "driver": "mujoco"},
]
TRAINER = {
    "steps": 600,
    "evaluation": {"everySteps": 300, "episodes": 1, "confirmEpisodes": 2},
    "checkpoint": {"everySteps": 300, "keep": 2},
}
SEEING_STEPS = 256
COLORS = 3
# The script prints the environment of the simulator. Only the first words are compared, because the script's
# own command line contains the simulator's name too.
ENVIRONMENT = """
from pathlib import Path
for process in Path("/proc").glob("[0-9]*"):
    try:
        words = (process / "cmdline").read_bytes().split(bytes(1))
        if any(word.endswith(b"/palaestra-mujoco") for word in words[:2]):
            print(*(process / "environ").read_text().split(chr(0)), sep=chr(10))
    except OSError:
        pass
"""
DRAW = """
import mujoco
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><light pos="0 0 3"/><geom type="box" size=".3 .3 .3" rgba="1 0 0 1"/>'
    '<camera name="above" pos="0 0 2"/></worldbody></mujoco>'
)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 48, 64) as renderer:
    renderer.update_scene(data, "above")
    red, green, blue = renderer.render()[24, 32]
print("red" if red > 2 * max(green, blue) else (red, green, blue))
"""


def test_a_policy_is_trained_in_mujoco(namespace, job):
    """A complete run shows that image, driver and trainer fit together.

    The simulator must draw on one thread, because simulators share a node's cores.
    """
    namespace.apply(job("mujoco", simulators=SIMULATORS, trainer=TRAINER))
    pod = namespace.wait_for_pod("mujoco")

    said = namespace.wait(
        lambda: namespace.execute(pod, "python3", "-c", ENVIRONMENT, container="sim-collect-0"), LONG_S
    )

    assert "LP_NUM_THREADS=0" in said.splitlines()
    assert namespace.wait_for_end("mujoco", LONG_S) == "Succeeded"
    replica = namespace.replica("mujoco")
    assert replica["step"] == 600
    assert replica["restarts"]["trainer"] == 0


@pytest.fixture
def seeing():
    """Return manifests/examples/see-target.yaml with a few steps, and one simulator of each role."""
    job = example("see-target")
    collect, _ = job["spec"]["simulators"]
    collect |= {"count": 1, "env": SLOW}
    trainer = job["spec"]["trainer"]
    trainer["environment"]["options"]["max_steps"] = 40
    trainer["algorithm"]["hyperparameters"] |= {"n_steps": 64, "batch_size": 64, "n_epochs": 1}
    trainer |= {
        "steps": SEEING_STEPS,
        "evaluation": {"everySteps": SEEING_STEPS // 2, "episodes": 1, "confirmEpisodes": 0},
        "checkpoint": {"everySteps": SEEING_STEPS // 2, "keep": 2},
    }
    return job


def test_a_policy_is_trained_on_what_a_camera_sees(namespace, seeing, tmp_path):
    """A policy with a camera must train in a pod without a GPU.

    Each observation contains an image of 64 x 48 pixels, which Mesa draws on the simulator's own thread.
    """
    namespace.apply(seeing)
    pod = namespace.wait_for_pod("see-target")

    said = namespace.wait(
        lambda: namespace.execute(pod, "python3", "-c", ENVIRONMENT, container="sim-collect-0"), LONG_S
    )

    assert "LP_NUM_THREADS=0" in said.splitlines()
    assert namespace.wait_for_end("see-target", LONG_S) == "Succeeded"
    assert namespace.replica("see-target")["step"] == SEEING_STEPS
    code, told = typed(namespace, "fetch", "see-target", f"--dir={tmp_path}")
    assert code == 0, told
    with zipfile.ZipFile(tmp_path / "see-target/0/model.zip") as file:
        weights = torch.load(io.BytesIO(file.read("policy.pth")), weights_only=True)
    assert any(weight.ndim == 4 and weight.shape[1] == COLORS for weight in weights.values())


@pytest.mark.beside
def test_the_image_of_mujoco_draws_without_a_screen(namespace, job):
    """The container has no GPU, no root permissions and a read-only file system, and must still render."""
    namespace.apply(job("draws", script=WAIT, simulator={"driver": "mujoco"}))
    pod = namespace.wait_for_pod("draws")

    drawn = ["env", "MUJOCO_GL=egl", "LP_NUM_THREADS=0", "python3", "-c", DRAW]

    assert namespace.execute(pod, *drawn, container="sim-collect-0").split() == ["red"]
