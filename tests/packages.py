"""Policy packages without a training: a network of one layer that drives to the target."""

import json
import math

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from palaestra_protocol.package_archive import archived
from palaestra_protocol.policy_package import MANIFEST, NETWORK, TRAINING, manifest_text
from palaestra_trainer.environments.data_sheet import environment_sheet, parts_of
from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.job.configuration import Environment, dump, parse
from palaestra_trainer.testing import fake_arena, fake_seeing

NUMBERS, TARGET = 16, (13, 14)  # the size of MoveToTargetEnv's observation, and the target's indices in it


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


def seeing_network(shape, speed=0.4, gain=20.0):
    """Return an ONNX file that drives forward, and turns toward the red part of an image.

    The turn is the mean over all pixels of `gain` * redness * place; the place is 1 at the left edge of the
    image.
    """
    rows, columns, _ = shape
    red = np.array([1.0, -0.5, -0.5], np.float32) / 255.0
    left = np.linspace(1.0, -1.0, columns, dtype=np.float32)
    weights = np.zeros((math.prod(shape), 3), np.float32)
    turns = gain * left[None, :, None] * red[None, None, :] / (rows * columns)
    weights[:, 2] = np.broadcast_to(turns, shape).ravel()
    image = helper.make_tensor_value_info("observation", TensorProto.UINT8, ["batch", *shape])
    action = helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", 3])
    parts = {"weights": weights, "bias": np.array([speed, 0.0, 0.0], np.float32)}
    bounds = {"l": np.array(-1, np.float32), "h": np.array(1, np.float32)}
    nodes = [
        helper.make_node("Cast", ["observation"], ["floats"], to=TensorProto.FLOAT),
        helper.make_node("Flatten", ["floats"], ["flat"], axis=1),
        helper.make_node("MatMul", ["flat", "weights"], ["turned"]),
        helper.make_node("Add", ["turned", "bias"], ["wanted"]),
        helper.make_node("Clip", ["wanted", "l", "h"], ["action"]),
    ]
    constants = [numpy_helper.from_array(value, name) for name, value in (parts | bounds).items()]
    graph = helper.make_graph(nodes, "seeing", [image], [action], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    return model.SerializeToString()


def write_seeing_package(place):
    """Write a package whose policy sees only the image of a camera, and drives to a red pole."""
    environment = {"id": "SeeTarget-v0", "options": {"actions": "continuous"}}
    return _written(place, environment, fake_seeing(), seeing_network((48, 64, 3)))


def write_package(place, *, gain=1.0, robot="Robotino", period_s=0.192, options=None):
    """Write a package whose policy drives to the target, as a folder or a zip, and return its place."""
    environment = {"id": "MoveToTargetEnv-v0", "options": {"actions": "continuous"} | (options or {})}
    drives = {"class": robot, "period_s": period_s}
    return _written(place, environment, fake_arena(), linear_network(gain), drives)


def _written(place, environment, fake, network, robot=None):
    simulators = [{"name": "collect-0", "group": "collect", "index": 0, "role": "Collect"}]
    wanted = Environment(**environment)
    arena = make_environment(wanted, *fake)
    sheet = environment_sheet(parts_of(arena.observation_space), arena.action_space, wanted)
    job = {"job": "linear", "environment": environment, "steps": 1, "simulators": simulators}
    files = {NETWORK: network, TRAINING: dump(parse(job)).encode()}
    about = {
        "job": "linear",
        "robot": robot or {"class": "Robotino", "period_s": 0.192},
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
