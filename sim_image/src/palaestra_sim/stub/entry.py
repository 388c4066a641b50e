"""The start of `palaestra-stub`: the check for Linux precedes the imports, which fail elsewhere."""

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
