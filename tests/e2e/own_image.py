"""Build a user's own image from one of the release's: python -m tests.e2e.own_image FOLDER NAME [BASE].

BASE is the release's image from which the Dockerfile begins, by default "trainer". FOLDER contains the
Dockerfile. The program writes an archive next to FOLDER and prints the path of the archive. Tests run the
program as a process of its own, because the lock of the image store works only in a main thread.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools.images import cache
from tools.images.engines import Buildah, Docker, Order

ROOT = Path(__file__).parents[2]
ARCHIVES = "PALAESTRA_E2E_IMAGES"  # names a file with a line NAME=ARCHIVE per image; e2e.sh sets the variable
LOCK_DEADLINE_S, BUILD_S, LOAD_S = 300, 600, 300


def main() -> None:
    """Build the image; the command line is in the module's docstring."""
    context, name, base = Path(sys.argv[1]), sys.argv[2], (*sys.argv[3:], "trainer")[0]
    archive = context.with_name(f"{context.name}.tar")
    store = cache.folder() / "images"
    with cache.locked(cache.folder() / "locks" / "images", LOCK_DEADLINE_S):
        engine = Docker.here() or Buildah.here(store, ROOT)
        engine.load(archives()[base], archive.with_name("load.log"))
        engine.build(
            Order(
                reference=f"docker.io/library/{name}",
                dockerfile=context / "Dockerfile",
                context=context,
                arguments={},
                archive=archive,
                log=archive.with_name("build.log"),
            )
        )
    sys.stdout.write(f"{archive}\n")


def skip_without_archives() -> None:
    """Skip the test if no image can be built or loaded here."""
    if ARCHIVES not in os.environ or os.environ.get("PALAESTRA_CLUSTER") == "existing":
        pytest.skip("the release's archives or the cluster's engine are not here; `make e2e` has both")


def load_image(context: Path, name: str, base: str = "trainer") -> str:
    """Build the image of a folder in a process of its own, load it into the cluster, and return its name."""
    build = [sys.executable, "-m", "tests.e2e.own_image", context, name, base]
    archive = subprocess.run(build, cwd=ROOT, check=True, timeout=BUILD_S, stdout=subprocess.PIPE, text=True)
    load = [ROOT / "tests/cluster/load.sh", archive.stdout.strip()]
    subprocess.run(load, check=True, timeout=LOAD_S)
    return name


def archives() -> dict[str, Path]:
    """Return the archive of each image; for the operator, which has two tags, return the last archive."""
    lines = Path(os.environ[ARCHIVES]).read_text().splitlines()
    return {name: Path(archive) for name, _, archive in (line.partition("=") for line in lines)}


if __name__ == "__main__":
    main()
