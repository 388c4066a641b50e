"""The control plane: the TrainingJob, its plan, the local runner, and a client of clusters."""

from palaestra_protocol.shadowing import settle_imports

settle_imports()

from importlib import import_module
from typing import TYPE_CHECKING, Any

__all__ = ["Client", "changed", "run", "show"]

if TYPE_CHECKING:
    from palaestra.client import Client
    from palaestra.job_input import changed
    from palaestra.live_view.view_process import show
    from palaestra.local.run_handle import run
else:
    _HOMES = {
        "Client": "palaestra.client",
        "changed": "palaestra.job_input",
        "run": "palaestra.local.run_handle",
        "show": "palaestra.live_view.view_process",
    }

    def __getattr__(name: str) -> Any:
        """Return a public name. Import its module only now: a program that only plans imports no client."""
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(_HOMES[name]), name)
