"""The start of `palaestra-mujoco`: it checks for Linux before it imports modules that need Linux."""

import sys
from importlib import import_module

from palaestra_protocol.linux import require_linux


def main() -> int:
    """Run the simulator until a client or a signal ends it; return the exit code."""
    require_linux("palaestra-mujoco")
    code: int = import_module("palaestra_sim.mujoco.cli").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
