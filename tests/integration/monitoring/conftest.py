"""Operators to start, as for the operator's own tests."""

from tests.integration.operator.conftest import start

__all__ = ["start"]
