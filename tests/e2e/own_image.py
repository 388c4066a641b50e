"""Build an image of a user's own, FROM one of the release's: python -m tests.e2e.own_image FOLDER NAME.

FOLDER holds the Dockerfile. Prints the path of the archive, which is written beside FOLDER. A process of its
own, because the lock of the images' store is for the main thread of one.
"""

import os
import sys
from pathlib import Path

from tools.images import cache
from tools.images.engines import Buildah, Docker, Order

ROOT = Path(__file__).parents[2]
ARCHIVES = "PALAESTRA_E2E_IMAGES"  # a file with a line NAME=ARCHIVE for each; tests/cluster/e2e.sh sets it
LOCK_DEADLINE_S = 300


def main() -> None:
    """Build it; the command line is in the module's docstring."""
    context, name = Path(sys.argv[1]), sys.argv[2]
    archive = context.with_name(f"{context.name}.tar")
    store = cache.folder() / "images"
    with cache.locked(cache.folder() / "locks" / "images", LOCK_DEADLINE_S):
        engine = Docker.here() or Buildah.here(store, ROOT)
        engine.load(archives()["trainer"], archive.with_name("load.log"))
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


def archives() -> dict[str, Path]:
    """Return the archives by image; of the operator, which is there under two tags, the last."""
    lines = Path(os.environ[ARCHIVES]).read_text().splitlines()
    return {name: Path(archive) for name, _, archive in (line.partition("=") for line in lines)}


if __name__ == "__main__":
    main()
