"""`python -m tools.models DIR...`: count the MuJoCo models in folders that start without changes.

dm_control, gymnasium, gymnasium-robotics, metaworld and robosuite have 140 models with an actuator. You need
only the wheels of these packages, without their dependencies:

    uv pip install --no-deps --target DIR dm_control gymnasium gymnasium-robotics metaworld robosuite
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

DEADLINE_S: Final = 180.0
# Files without an actuator do not count as models. Files that MuJoCo refuses do not count either, because
# they are parts of other files.
IS_MODEL: Final = "import mujoco, sys; sys.exit(mujoco.MjModel.from_xml_path(sys.argv[1]).nu == 0)"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the count and the refusals; return 0 if every model starts."""
    parser = argparse.ArgumentParser(prog="python -m tools.models", description=__doc__.splitlines()[0])
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path)
    folders = parser.parse_args(arguments).folders
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        answers = [it for it in pool.map(refusal, files(folders)) if it is not None]
    refused = [it for it in answers if it]
    for text in refused:
        sys.stdout.write(f"{text}\n")
    sys.stdout.write(
        f"{len(answers) - len(refused)} of {len(answers)} models with an actuator start as they are\n"
    )
    return 1 if refused else 0


def files(folders: Sequence[Path]) -> Iterator[Path]:
    """Yield the XML files below the folders."""
    for folder in folders:
        yield from sorted(folder.rglob("*.xml"))


def refusal(file: Path) -> str | None:
    """Return the refusal of a model; "" if it starts; None if the file is not a model with an actuator."""
    if run(sys.executable, "-c", IS_MODEL, file).returncode:
        return None
    check = run(Path(sys.executable).with_name("palaestra-mujoco"), "--check", file)
    return f"{file}: {check.stderr.splitlines()[-1]}" if check.returncode else ""


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a program to its end."""
    return subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)


if __name__ == "__main__":
    sys.exit(main())
