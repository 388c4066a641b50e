"""Policy packages without a training: a network of one layer that drives to the target."""

import json

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from palaestra_protocol.package_archive import archived
from palaestra_protocol.policy_package import MANIFEST, NETWORK, TRAINING, manifest_text
from palaestra_trainer.environments.data_sheet import environment_sheet, parts_of
from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.job.configuration import Environment, dump, parse
from palaestra_trainer.testing import fake_arena

NUMBERS, TARGET = 16, (13, 14)  # numbers of the observation of MoveToTargetEnv, and those of the target


def linear_network(gain=1.0):
    """Return an ONNX file whose action is the direction to the target times `gain`, within [-1, 1]."""
    weights = np.zeros((NUMBERS, 3), np.float32)
    for action, number in enumerate(TARGET):
        weights[number, action] = gain
    batch = [("observation", NUMBERS), ("action", 3)]
    taken, given = (
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width]) for name, width in batch
    )
    bounds = [
        numpy_helper.from_array(np.array(bound, np.float32), name) for name, bound in (("l", -1), ("h", 1))
    ]
    nodes = [
        helper.make_node("MatMul", ["observation", "weights"], ["wanted"]),
        helper.make_node("Clip", ["wanted", "l", "h"], ["action"]),
    ]
    parts = [numpy_helper.from_array(weights, "weights"), *bounds]
    graph = helper.make_graph(nodes, "linear", [taken], [given], parts)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    return model.SerializeToString()


def write_package(place, *, gain=1.0, robot="Robotino", period_s=0.192, options=None):
    """Write a package whose policy drives to the target, as a folder or a zip, and return its place."""
    environment = {"id": "MoveToTargetEnv-v0", "options": {"actions": "continuous"} | (options or {})}
    simulators = [{"name": "collect-0", "group": "collect", "index": 0, "role": "Collect"}]
    wanted = Environment(**environment)
    arena = make_environment(wanted, *fake_arena())
    sheet = environment_sheet(parts_of(arena.observation_space), arena.action_space, wanted)
    job = {"job": "linear", "environment": environment, "steps": 1, "simulators": simulators}
    files = {NETWORK: linear_network(gain), TRAINING: dump(parse(job)).encode()}
    about = {
        "job": "linear",
        "robot": {"class": robot, "period_s": period_s},
        "policy": sheet,
    }
    files[MANIFEST] = manifest_text(about, files)
    if place.suffix == ".zip":
        place.write_bytes(archived(files))
        return place
    place.mkdir(parents=True)
    for name, content in files.items():
        (place / name).write_bytes(content)
    return place


def changed_manifest(folder, **fields):
    """Change fields of a package's manifest."""
    manifest = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps(manifest | fields))
