"""Act with a policy of a package, by onnxruntime and NumPy alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from palaestra_trainer.errors import ConfigurationError

_STATE: Final = ("hidden", "cell")
_MASKS: Final = "action_masks"
_ONE: Final = "observation"  # the input of a policy whose observations are not a Dict


class OnnxPolicy:
    """The deterministic policy of a package, with its recurrent state.

    Args:
        network: the content of the ONNX file, as `palaestra export` writes it.
        file: the path of this file, for messages.
        sheet: the data sheet in the package's manifest.

    Raises:
        ConfigurationError: onnxruntime does not load the network.
    """

    def __init__(self, network: bytes, file: Path, sheet: Mapping[str, Any]) -> None:
        self._session = _session(network, file)
        self._state_shape: tuple[int, int] | None = None
        if (shape := sheet.get("state_shape")) is not None:
            self._state_shape = (int(shape[0]), int(shape[1]))
        self._state: dict[str, NDArray[np.float32]] = {}
        self._inputs = [each.name for each in self._session.get_inputs()]
        self._outputs = [each.name for each in self._session.get_outputs()]
        self.begin()

    @property
    def takes_masks(self) -> bool:
        """Whether `act` needs a mask of allowed actions."""
        return _MASKS in self._inputs

    def begin(self) -> None:
        """Begin an episode: reset the state of a recurrent policy."""
        if self._state_shape is not None:
            layers, units = self._state_shape
            self._state = {name: np.zeros((layers, 1, units), np.float32) for name in _STATE}

    def act(self, observation: Any, mask: NDArray[np.bool_] | None = None) -> Any:
        """Return the action for one observation, as the environment takes it.

        Args:
            observation: an array, or a dictionary of arrays, as the environment returned it.
            mask: which choices are allowed, shape (choices,), if `takes_masks`.
        """
        parts = observation if isinstance(observation, Mapping) else {_ONE: observation}
        given = {name: np.asarray(part)[None] for name, part in parts.items() if name in self._inputs}
        if mask is not None and self.takes_masks:
            given[_MASKS] = mask[None]
        given |= {name: self._state[name] for name in self._state if name in self._inputs}
        results = dict(zip(self._outputs, self._session.run(None, given), strict=True))
        self._state = {name: results.get(f"next_{name}", old) for name, old in self._state.items()}
        return results["action"][0]


def _session(network: bytes, file: Path) -> Any:
    options = onnxruntime.SessionOptions()
    # More threads would not help a small network, and would take processor time from the robot's programs.
    options.intra_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(network, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime raises classes of its own, without a common base
        raise ConfigurationError(
            f"{file}: onnxruntime does not load it ({error}); export it again"
        ) from error
