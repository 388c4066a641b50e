"""Start a simulator with ROS names that no other simulator uses."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.launcher import Place
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest

_MOST_BESIDE = 100


def launch_beside_others(place: Place, request: SimulatorRequest) -> OwnedSidecar:
    """Return a sidecar with the world's ROS names, or with `_2`, `_3`, ... appended if they are in use.

    Raises:
        ConfigurationError: the place or the sidecar refused the request, or all names are in use.
    """
    for number in range(1, _MOST_BESIDE + 1):
        sidecar = place.launch(replace(request, suffix="" if number == 1 else f"_{number}"))
        with ExitStack() as undo:
            undo.callback(sidecar.close)
            if sidecar.reserve():
                undo.pop_all()
                return sidecar
    raise ConfigurationError(
        f"{request.world}: {_MOST_BESIDE} simulators with its ROS names are already running; "
        "close unused ones"
    )
