"""The fixtures that start operators, shared with the operator's tests."""

from tests.integration.operator.conftest import start

__all__ = ["start"]
