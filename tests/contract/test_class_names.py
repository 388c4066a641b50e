"""A class name has one meaning in the repository, so that a search for the name finds one class."""

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = ("operator/src", "trainer/src", "sim_image/src")

FIELD = "a field of a job: as its author writes it, and as the trainer reads it from training.yaml"
DEVICE = "a device of Webots: its facade in the trainer, and its simulation"
ALLOWED_TWICE = {
    **dict.fromkeys(("Algorithm", "Callback", "Checkpoint", "Evaluation", "Normalize"), FIELD),
    **dict.fromkeys(("Recycle", "Restart"), FIELD),
    **dict.fromkeys(("Camera", "DistanceSensor", "Lidar", "Motor", "MujocoActuator"), DEVICE),
    **dict.fromkeys(("MujocoSensor", "PositionSensor", "RangeFinder", "TouchSensor"), DEVICE),
    **dict.fromkeys(("Accelerometer", "Altimeter", "Compass", "Gyro", "InertialUnit", "LightSensor"), DEVICE),
    **dict.fromkeys(("Brake", "Connector", "Display", "Emitter", "Pen", "Speaker", "VacuumGripper"), DEVICE),
    **dict.fromkeys(("Device", "Radar", "RadarTarget", "Receiver", "Skin"), DEVICE),
    "Driver": "the driver of a simulator: as a job names it, and as the sidecar starts it",
    "Master": "a client of the ROS master: the trainer's, with deadlines, and the simulators', in their loop",
    "Mode": "the mode of a simulation, with Webots' numbers: for the facade, and for the simulator",
    "Pose": "a pose: on the floor in the trainer, in space in the simulators",
    "SimulatorStatus": "the status of a simulator: as the trainer reports it, and in a job's status",
    "SuccessInterval": "the interval of a success rate: as the trainer reports it, and in a job's status",
}


def homes():
    """Return the modules that define each public class name."""
    found = defaultdict(list)
    for source in SOURCES:
        for path in sorted((ROOT / source).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT / source).with_suffix("").parts)
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    found[node.name].append(module)
    return found


def test_a_class_name_has_one_meaning():
    """Two classes with one name make every search, import and traceback ambiguous."""
    twice = {name: modules for name, modules in homes().items() if len(modules) > 1}

    assert {name: modules for name, modules in twice.items() if name not in ALLOWED_TWICE} == {}
    assert sorted(ALLOWED_TWICE) == sorted(twice)
