"""The control plane: the TrainingJob, its plan, the local runner, and a client of clusters."""

from typing import TYPE_CHECKING, Any

__all__ = ["Client"]

if TYPE_CHECKING:
    from palaestra.client import Client
else:

    def __getattr__(name: str) -> Any:
        """Return `Client`, imported when it is asked for: plans and schemas need no cluster."""
        if name != "Client":
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from palaestra.client import Client  # noqa: PLC0415 - see above

        return Client
