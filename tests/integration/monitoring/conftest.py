"""A control plane with the installation in it, and operators to start, as for the operator's own tests."""

from tests.integration.operator.conftest import control_plane, installed, place, start

__all__ = ["control_plane", "installed", "place", "start"]
