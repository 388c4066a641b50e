"""Write the image of Kueue's manager like the image that its project releases, and name it in the chart.

python3 -m tests.cluster.kueue PROGRAM VALUES OUT writes an OCI archive of the built program, and rewrites the
chart's values.yaml. It uses only the standard library.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path, PurePosixPath

from tests.cluster.archive import Image, write_archive
from tests.cluster.images import version_of

REPOSITORY = "registry.k8s.io/kueue/kueue"


def version() -> str:
    """Return the version of Kueue that the tests build, such as "v0.19.1"."""
    return version_of("kueue", "sigs.k8s.io/kueue")


def manager(program: Path) -> Image:
    """Return the manager's image; Kueue's chart runs `/manager` in it as a user other than root."""
    return Image(
        name=f"{REPOSITORY}:{version()}",
        entrypoint="/manager",
        files={PurePosixPath("manager"): program},
        user="65532:65532",
    )


def released(values: str) -> str:
    """Return the chart's values.yaml with the image of `manager`, as in the released chart.

    The module's chart names a staging image with the pull policy Always, so a node would not use the loaded
    image. The manager's image is the first one below `controllerManager`.

    Raises:
        LookupError: the file has no such image.
    """
    for key, value in (("repository", REPOSITORY), ("tag", version()), ("pullPolicy", "IfNotPresent")):
        first = re.compile(rf"^(controllerManager:\n.*?^ {{6}}{key}: )[^\n]*", re.MULTILINE | re.DOTALL)
        values, found = first.subn(rf"\g<1>{value}", values)
        if not found:
            message = f"Kueue's values.yaml has no {key} of an image below controllerManager."
            raise LookupError(message)
    return values


if __name__ == "__main__":
    write_archive(manager(Path(sys.argv[1])), Path(sys.argv[3]))
    chosen = Path(sys.argv[2])
    chosen.write_text(released(chosen.read_text(encoding="utf-8")), encoding="utf-8")
