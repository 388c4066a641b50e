"""The command line as in a pod: `in_a_pod.py FOLDER operator …`; FOLDER has the service account's files."""

import io
import sys
from contextlib import redirect_stdout, suppress
from pathlib import Path

from palaestra.cli import main

if __name__ == "__main__":
    folder, *arguments = sys.argv[1:]
    with suppress(SystemExit), redirect_stdout(io.StringIO()):
        main(["operator", "--help"])  # imports the same modules as an operator, and no others
    sys.modules["palaestra.cluster.service_account"].FILES = Path(folder)
    sys.exit(main(arguments))
