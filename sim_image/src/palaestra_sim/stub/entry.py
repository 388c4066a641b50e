"""The start of `palaestra-stub`: it checks for Linux before it imports modules that need Linux."""

import sys
from importlib import import_module

from palaestra_protocol.linux import require_linux


def main() -> int:
    """Run the simulator until a client or a signal ends it; return the exit code."""
    require_linux("palaestra-stub")
    code: int = import_module("palaestra_sim.stub.cli").main()
    return code


if __name__ == "__main__":
    sys.exit(main())
