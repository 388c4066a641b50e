"""The services and topics that a training needs, as calls in the world of an example.

The world is from examples/simulators/cart.yaml. Its only robot is a cart with two wheels and a distance
sensor, and is its own supervisor. `TRAINING` lists the calls in the order of a training.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import yaml

from palaestra_sim.faults.known_paths import survey
from palaestra_sim.scene.loader import Loader
from palaestra_sim.stub.physics import StubPhysics

ROBOT: Final = "cart"
STEP_MS: Final = 32
_JOB: Final = Path(__file__).parents[2] / "examples/simulators/cart.yaml"
_GET_FIELD: Final = "supervisor/node/get_field"
_NODE: Final = {"node": "@supervisor/get_from_def"}
_TRANSLATION: Final = {"field": f"@{_GET_FIELD}"}
_QUARTER: Final = {"x": 0.0, "y": 0.0, "z": math.sqrt(0.5), "w": math.sqrt(0.5)}

# Path and request of each call; a third item is the name of a call whose response another call needs.
TRAINING: Final[tuple[tuple[str, Mapping[str, Any]] | tuple[str, Mapping[str, Any], str], ...]] = (
    ("robot/get_time", {}),
    ("supervisor/simulation_set_mode", {"value": 2}),
    ("robot/get_device_list", {}),
    ("robot/get_number_of_devices", {}),
    ("supervisor/get_from_def", {"name": "CART"}),
    ("distance_sensor/enable", {"value": STEP_MS}),
    ("robot/set_custom_data", {"value": '{"seed": 1}'}),
    ("supervisor/simulation_reset", {}),
    ("robot/time_step", {"value": STEP_MS}),
    ("left_motor/set_position", {"value": math.inf}),
    ("right_motor/set_position", {"value": math.inf}),
    ("left_motor/set_velocity", {"value": 0.0}),
    ("right_motor/set_velocity", {"value": 0.0}),
    (_GET_FIELD, {**_NODE, "fieldName": "translation"}),
    (_GET_FIELD, {**_NODE, "fieldName": "rotation"}, "ROTATION"),
    ("supervisor/field/get_vec3f", _TRANSLATION),
    ("supervisor/field/set_vec3f", {**_TRANSLATION, "value": {"x": 0.5, "y": 0.25, "z": 0.0}}),
    ("supervisor/field/set_rotation", {"field": "@ROTATION", "value": _QUARTER}),
    ("supervisor/node/reset_physics", _NODE),
    ("supervisor/node/get_position", _NODE),
    ("supervisor/node/get_orientation", _NODE),
)
QUIT: Final = ("supervisor/simulation_quit", {"value": 0})
TOPIC: Final = "distance_sensor/value"


def world() -> str:
    """Return the text of the world file."""
    job = yaml.safe_load(_JOB.read_text())
    return str(job["spec"]["simulators"][0]["world"]["inline"])


def claims() -> dict[str, Any]:
    """Return the claims in the form of interface.json."""
    with TemporaryDirectory() as folder:
        path = Path(folder, f"{ROBOT}.wbt")
        path.write_text(world())
        known = survey(Loader(physics=StubPhysics), path)
    calls = [
        (*(named or [path]), path, known.services[path], request)
        for path, request, *named in (*TRAINING, QUIT)
    ]
    return {
        "robot": ROBOT,
        "step_ms": STEP_MS,
        "world": world(),
        "calls": calls[:-1],
        "topics": {TOPIC: known.topics[TOPIC]},
        "last": calls[-1:],
    }
