"""`make images`: build changed images, and print the paths of archives and bills of materials."""

import argparse
import platform
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from tools.images import bills, cache, webots
from tools.images.building import Built, Workshop, say
from tools.images.engines import Buildah, Docker
from tools.images.errors import ImagesError
from tools.images.recipes import Recipe, recipes

ROOT = Path(__file__).parents[2]
LOCK_DEADLINE_S = 3600  # another call may hold the lock while it builds everything
INTERRUPTED = 130
EPILOG = "$PALAESTRA_CACHE/images (default: ~/.cache/palaestra) keeps the last three archives of each image."


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the named images; return 0, or 1 if an image could not be built, or 130 after Ctrl-C."""
    parser = _parser()
    options = parser.parse_args(arguments)
    known = recipes(options.torch)
    if options.webots is None and webots.RECIPE.name in options.names:
        parser.error("webots: needs the archive of Webots; replace the name with --webots ARCHIVE")
    if unknown := [name for name in options.names if name not in {*known, webots.RECIPE.name}]:
        parser.error(f"{unknown[0]} is not an image; choose from {', '.join(known)}")
    if options.webots is None and (options.webots_assets or options.webots_sha256):
        parser.error("--webots-assets and --webots-sha256 need --webots ARCHIVE")
    folder = cache.folder() / "images"
    try:
        wanted = _wanted(known, options)
        with cache.locked(cache.folder() / "locks" / "images", LOCK_DEADLINE_S):
            engine = Docker.here() or Buildah.here(folder, ROOT)
            workshop = Workshop(root=ROOT, engine=engine, folder=folder)
            built = {name: workshop.build(recipe, options.tag) for name, recipe in wanted.items()}
            of_images = {name: bills.of_image(image) for name, image in built.items()}
            of_wheels = bills.of_wheels(ROOT, folder, workshop.machine)
    except ImagesError as error:
        say(str(error))
        return 1
    except KeyboardInterrupt:
        return INTERRUPTED
    for name, image in built.items():
        sys.stdout.write(f"{name}={image.archive}\n" if options.archives else _row(image, of_images[name]))
    if not options.archives:
        sys.stdout.writelines(f"{bill}\n" for bill in of_wheels)
    return 0


def _wanted(known: Mapping[str, Recipe], options: argparse.Namespace) -> Mapping[str, Recipe]:
    """Return the recipes of the named images, and of Webots with --webots; without both, all recipes."""
    if options.webots is None:
        return {name: known[name] for name in options.names or known}
    own = webots.of_archive(options.webots, options.webots_assets, options.webots_sha256, platform.machine())
    return {own.name: own} | {name: known[name] for name in options.names if name != own.name}


def _row(image: Built, bill: Path) -> str:
    return f"{image.reference}  {image.archive.stat().st_size / 1e6:,.0f} MB  {image.archive}  {bill}\n"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/images.sh", description="Build the container images that have changed.", epilog=EPILOG
    )
    add = parser.add_argument
    add("names", nargs="*", metavar="NAME", help="of stub, mujoco, trainer, notebook, operator; default: all")
    add(
        "--torch",
        choices=("debian", "cuda"),
        default="debian",
        help="PyTorch of trainer and notebook (default: %(default)s)",
    )
    add("--tag", help="tag of the images; default: the version")
    add(
        "--webots",
        type=Path,
        metavar="ARCHIVE",
        help="build the image of Webots from the downloaded archive of a release, and the NAMEs",
    )
    add("--webots-assets", type=Path, metavar="ZIP", help="archive of the release's assets, for use offline")
    add("--webots-sha256", metavar="HEX", help="refuse an archive of Webots with another SHA-256")
    add("--archives", action="store_true", help="print lines of NAME=ARCHIVE, for scripts")
    return parser


if __name__ == "__main__":
    sys.exit(main())
