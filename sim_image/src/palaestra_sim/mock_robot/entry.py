"""The start of `palaestra-mock-robot`: it checks for Linux before it imports modules that need Linux."""

import sys
from importlib import import_module

from palaestra_protocol.linux import require_linux


def main() -> int:
    """Run the mock robot until a signal ends it; return the exit code."""
    require_linux("palaestra-mock-robot")
    code: int = import_module("palaestra_sim.mock_robot.cli").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
