"""Convert a policy to an ONNX file, which any ONNX runtime can run without other code."""

from __future__ import annotations

import json
import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import torch

from palaestra_trainer.environments.masks import ACTION_MASKS
from palaestra_trainer.errors import ExportError, fact_of
from palaestra_trainer.exporting.metadata import KEY
from palaestra_trainer.exporting.policy_module import STATE, PolicyModule
from palaestra_trainer.exporting.sample_observations import drawn, drawn_masks
from palaestra_trainer.exporting.verify import Arrays, Run

OPSET = 17  # the opset of ONNX 1.12, released in 2022
# PyTorch's exporter does not accept the types on the left, but accepts the larger types on the right.
_UNTAKEN = {"uint16": "int32", "uint32": "int64", "uint64": "int64"}
_BATCH = 3  # larger than 1, because the exporter could treat a size of 1 as a constant


def content(acting: PolicyModule, sheet: Mapping[str, Any]) -> bytes:
    """Return the bytes of the file, with the data sheet in its metadata; batches may have any size.

    PyTorch omits inputs that do not affect an output. The data sheet lists these inputs as `unused`.

    Raises:
        ExportError: PyTorch's exporter cannot convert the policy.
    """
    for name, space in acting.spaces.items():
        if larger := _UNTAKEN.get(str(space.dtype)):
            raise ExportError(
                f"the input {name} is {space.dtype}, which PyTorch does not write to ONNX; nothing was "
                f"written; use {larger} or float32 in the environment, or --to safetensors"
            )
    try:
        model = _converted(acting)
    except RuntimeError as error:
        raise ExportError(
            f"the policy cannot be converted to ONNX ({fact_of(error)}); nothing was written; use another "
            "type or network, --to safetensors, or load_policy"
        ) from error
    inputs = [value.name for value in model.graph.input]
    unused = [name for name in acting.inputs if name not in inputs]
    model.producer_name = "palaestra"
    onnx.helper.set_model_props(model, {KEY: json.dumps({**sheet, "inputs": inputs, "unused": unused})})
    onnx.checker.check_model(model)
    text: bytes = model.SerializeToString(deterministic=True)
    return text


def _converted(acting: PolicyModule) -> onnx.ModelProto:
    parts = [*drawn(acting, _BATCH).values(), *([drawn_masks(acting, _BATCH)] if acting.choices else [])]
    examples = [torch.from_numpy(part) for part in parts]
    axes = {name: {0: "batch"} for name in (*acting.spaces, ACTION_MASKS, "action")}
    axes |= {prefix + name: {1: "batch"} for name in STATE for prefix in ("", "next_")}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        written = Path(folder) / "policy.onnx"
        # The exporter warns about Python values that it treats as constants. If such a value is not constant,
        # the later comparison of the file with the policy fails.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            acting,
            (*examples, *acting.begin(_BATCH)),
            written,
            input_names=acting.inputs,
            output_names=acting.outputs,
            dynamic_axes={name: axes[name] for name in (*acting.inputs, *acting.outputs)},
            opset_version=OPSET,
            dynamo=False,
        )
        return onnx.load_model(written)


def runner(file: bytes, acting: PolicyModule) -> Run:
    """Return a function that runs the file; the function accepts unused inputs too."""
    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
    used = {value.name for value in session.get_inputs()}

    def run(*inputs: np.ndarray) -> Arrays:
        given = zip(acting.inputs, inputs, strict=True)
        outputs = session.run(acting.outputs, {name: part for name, part in given if name in used})
        return tuple(np.asarray(output) for output in outputs)

    return run


def sheet_of(file: bytes) -> dict[str, Any]:
    """Return the data sheet in the file's metadata."""
    known = {entry.key: entry.value for entry in onnx.load_model_from_string(file).metadata_props}
    sheet: dict[str, Any] = json.loads(known[KEY])
    return sheet
