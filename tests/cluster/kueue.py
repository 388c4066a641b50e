"""Write the image of Kueue's manager as its project ships it: one program that runs as nobody.

python3 -m tests.cluster.kueue PROGRAM OUT: from the built program to an OCI archive. Standard library only.
"""

from __future__ import annotations

import sys
from pathlib import Path, PurePosixPath

from tests.cluster.archive import Image, write_archive
from tests.cluster.images import version_of

REPOSITORY = "registry.k8s.io/kueue/kueue"


def manager(program: Path) -> Image:
    """Return the image; Kueue's chart calls `/manager` in it and refuses to run it as root."""
    return Image(
        name=f"{REPOSITORY}:{version_of('kueue', 'sigs.k8s.io/kueue')}",
        entrypoint="/manager",
        files={PurePosixPath("manager"): program},
        user="65532:65532",
    )


if __name__ == "__main__":
    write_archive(manager(Path(sys.argv[1])), Path(sys.argv[2]))
