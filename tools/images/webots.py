"""The recipe of the image of Webots; the person who builds the image downloads the archive of Webots first.

Webots is large, and this project neither distributes nor downloads it. So `make images` does not build this
image, and the digests of the archives are arguments of the Dockerfile, which checks them.
"""

import hashlib
import re
from dataclasses import replace
from pathlib import Path

from tools.images.errors import ImagesError
from tools.images.recipes import Recipe

RECIPE = Recipe(
    name="webots",
    dockerfile="sim_image/Dockerfile.webots",
    packages=("sim_image",),
    files=("sim_image/webots/install.sh", "sim_image/webots/webots.sh"),
)
_NAME = re.compile(r"webots-(R\d{4}[a-z])-x86-64(_ubuntu-\d\d\.\d\d)?\.tar\.bz2")
_MACHINE = "x86_64"


def of_archive(archive: Path, assets: Path | None, expected: str | None, machine: str) -> Recipe:
    """Return the recipe for an archive of Webots, and for an archive of its assets.

    `expected` is the SHA-256 that the archive of Webots must have; None accepts every archive.

    Raises:
        ImagesError: an archive cannot be read, has another digest or an unknown name, or no Webots exists
            for the `machine`.
    """
    release = _NAME.fullmatch(archive.name)
    if release is None:
        raise ImagesError(
            f"--webots: {archive.name} is not the name of an archive of Webots; give "
            "webots-R2025a-x86-64.tar.bz2 or another release, with the name of its download"
        )
    if machine != _MACHINE:
        raise ImagesError(f"--webots: Webots for Linux is built for {_MACHINE} only; build on such a machine")
    found = _digest("--webots", archive)
    if expected is not None and found != expected.lower():
        raise ImagesError(f"--webots: {archive} has the SHA-256 {found}, not {expected}; download it again")
    arguments, given = {"WEBOTS": release[1], "WEBOTS_SHA256": found}, {"webots.tar.bz2": archive}
    if assets is not None:
        arguments["ASSETS_SHA256"] = _digest("--webots-assets", assets)
        given["assets.zip"] = assets
    return replace(RECIPE, arguments=arguments, given=given)


def _digest(option: str, file: Path) -> str:
    try:
        with file.open("rb") as opened:
            return hashlib.file_digest(opened, "sha256").hexdigest()
    except OSError as error:
        raise ImagesError(f"{option}: {file}: {error.strerror}; give a file that you can read") from error
