"""A policy as an ONNX file, which any runtime of ONNX runs by itself."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch

from palaestra_trainer.exporting.acting import STATE, Acting
from palaestra_trainer.exporting.comparing import Arrays, Run, drawn
from palaestra_trainer.exporting.data_sheet import KEY

OPSET = 17  # of ONNX 1.12, of 2022
_BATCH = 3  # not 1, which the exporter could take for a constant


def content(acting: Acting, sheet: str) -> bytes:
    """Return the file with the data sheet in its metadata; any number of observations is one batch."""
    examples = [torch.from_numpy(part) for part in drawn(acting, _BATCH).values()]
    axes = {name: {0: "batch"} for name in (*acting.spaces, "action")}
    axes |= {prefix + name: {1: "batch"} for name in STATE for prefix in ("", "next_")}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        written = Path(folder) / "policy.onnx"
        # The exporter warns of Python values in policies that it takes for constants. The comparison decides.
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
        model = onnx.load_model(written)
    model.producer_name = "palaestra"
    onnx.helper.set_model_props(model, {KEY: sheet})
    onnx.checker.check_model(model)
    text: bytes = model.SerializeToString(deterministic=True)
    return text


def runner(file: bytes, acting: Acting) -> Run:
    """Return a function that runs the file."""
    session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])

    def run(*inputs: np.ndarray) -> Arrays:
        outputs = session.run(acting.outputs, dict(zip(acting.inputs, inputs, strict=True)))
        return tuple(np.asarray(output) for output in outputs)

    return run
