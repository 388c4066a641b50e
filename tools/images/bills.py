"""Bills of materials of our images and wheels, in the format CycloneDX, which vulnerability scanners read.

The bill of an image lists the packages in its archive. A wheel contains no other packages, so its bill lists
the packages that it was tested with: its part of the lock, with hashes.
"""

import json
import uuid
from collections.abc import Iterable
from pathlib import Path

from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL

from tools.images import context, inside, lock
from tools.images.building import Built
from tools.images.recipes import Recipe, project

VERSION = SchemaVersion.V1_6
ENDING = ".cdx.json"
# Our packages, each with all of our packages that it contains or needs.
WHEELS = {
    "sim_image": ("sim_image",),
    "trainer": ("sim_image", "trainer"),
    "operator": ("sim_image", "operator"),
}


def of_image(built: Built) -> Path:
    """Write the bill of an image next to its archive, unless the bill exists, and return the bill's path.

    This also removes the bills of archives that do not exist any more.

    Raises:
        ImagesError: the archive cannot be read.
    """
    bill = built.archive.with_name(f"{built.archive.name}{ENDING}")
    for old in built.archive.parent.glob(f"*.tar{ENDING}"):
        if not old.with_name(old.name.removesuffix(ENDING)).exists():
            old.unlink()
    if not bill.exists():
        name, _, tag = built.reference.rpartition("/")[2].partition(":")
        whole = Component(name=name, version=tag, type=ComponentType.CONTAINER, bom_ref=built.reference)
        bill.write_text(_text(whole, map(_installed, inside.packages(built.archive)), built.archive.name))
    return bill


def of_wheels(root: Path, folder: Path, machine: str) -> tuple[Path, ...]:
    """Write the bills of our wheels into a folder, and return their paths.

    Raises:
        ImagesError: the lock does not have the format that `make lock` writes.
    """
    return tuple(_of_wheel(root, folder, package, machine) for package in WHEELS)


def _of_wheel(root: Path, folder: Path, package: str, machine: str) -> Path:
    ours = [project(root, each) for each in WHEELS[package]]
    recipe = Recipe(name=package, dockerfile="", packages=WHEELS[package], extras=("train",))
    locked = context.contents(root, recipe, machine).requirements
    whole, *needed = (_wheel(one["name"], one["version"]) for one in reversed(ours))
    parts = (*needed, *map(_locked, lock.parse(locked.text)))
    bill = folder / f"{whole.name}-{whole.version}{ENDING}"
    folder.mkdir(parents=True, exist_ok=True)
    bill.write_text(_text(whole, parts, locked.digest))
    return bill


def _installed(package: inside.Package) -> Component:
    space = "debian" if package.kind == "deb" else None
    qualifiers = {"arch": package.architecture} if package.architecture else None
    return _component(PackageURL(package.kind, space, package.name, package.version, qualifiers))


def _wheel(name: str, version: str) -> Component:
    return _component(PackageURL("pypi", None, name, version))


def _locked(pin: lock.Pin) -> Component:
    component = _wheel(pin.name, pin.version)
    digests = (each.removeprefix("sha256:") for each in pin.hashes)
    component.hashes = [HashType(alg=HashAlgorithm.SHA_256, content=each) for each in digests]
    return component


def _component(url: PackageURL) -> Component:
    return Component(
        name=url.name, version=url.version, type=ComponentType.LIBRARY, purl=url, bom_ref=str(url)
    )


def _text(whole: Component, parts: Iterable[Component], content: str) -> str:
    """Return a bill as JSON, without a time, so that the same content gives the same bytes."""
    bill = Bom(components=parts, serial_number=uuid.uuid5(uuid.NAMESPACE_URL, f"{whole.bom_ref}#{content}"))
    bill.metadata.component = whole
    bill.register_dependency(whole, bill.components)
    written = json.loads(make_outputter(bill, OutputFormat.JSON, VERSION).output_as_string())
    del written["metadata"]["timestamp"]
    return json.dumps(written, indent=1)
