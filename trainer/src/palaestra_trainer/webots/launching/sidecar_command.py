"""The command line of a sidecar, and the address in its first line of output."""

from __future__ import annotations

import re

from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest

SIDECAR = "palaestra-sidecar"
_CONTROL = re.compile(r"control=(\S+)")


def sidecar_options(request: SimulatorRequest) -> list[str]:
    """Return the sidecar's options for a simulator, without the options of its listeners."""
    return [
        f"--driver={request.driver}",
        f"--world={request.world}",
        f"--suffix={request.suffix}",
        *(f"--option={option}" for option in request.options),
    ]


def control_address(line: str) -> str | None:
    """Return host and port of the control port in the sidecar's first line; None for another line."""
    found = _CONTROL.search(line)
    return found[1] if found else None
