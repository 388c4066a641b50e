"""Make an archive from a recipe, unless an archive with the same content exists already."""

import platform
import shutil
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tools.images import cache, context, programs
from tools.images.context import Contents
from tools.images.engines import Base, Engine, Order
from tools.images.errors import ImagesError
from tools.images.recipes import Recipe, digest, project

_KEPT = 3  # archives of an image: the newest, an archive that a test may use, and an archive of another tag
_KEPT_WHEELS = 6
_GIT_DEADLINE_S = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Built:
    """An image that exists: its full name and its archive."""

    reference: str
    archive: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """A requested image, with everything that determines its content except the day of the build."""

    recipe: Recipe
    version: str
    reference: str
    inside: Contents
    dockerfile: bytes
    base: Base
    machine: str

    def key(self) -> str:
        """Return the digest of all inputs, which is part of the archive's name."""
        return digest(
            (
                self.reference,
                self.machine,
                self.base.digest,
                self.dockerfile,
                *(f"{name}={value}" for name, value in sorted(self.recipe.arguments.items())),
                self.inside.requirements.digest,
                *([self.inside.extra.digest] if self.inside.extra else []),
                self.inside.packages_digest,
            )
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Workshop:
    """The builder of images, with its checkout, its engine and its folder of archives."""

    root: Path
    engine: Engine
    folder: Path
    machine: str = platform.machine()

    def build(self, recipe: Recipe, tag: str | None = None) -> Built:
        """Return an image, and build it if no archive has this content; the default of `tag` is the version.

        Raises:
            ImagesError: the image cannot be built.
        """
        wanted = self._wanted(recipe, tag)
        archive = self.folder / f"{recipe.name}-{wanted.key()}.tar"
        if archive.exists():
            cache.use(archive)
        else:
            say(f"building {wanted.reference}")
            started = time.monotonic()
            self._make(wanted, archive)
            say(f"built {wanted.reference} in {time.monotonic() - started:.0f} s")
        return Built(reference=wanted.reference, archive=archive)

    def _wanted(self, recipe: Recipe, tag: str | None) -> Wanted:
        version = project(self.root, recipe.packages[-1])["version"]
        return Wanted(
            recipe=recipe,
            version=version,
            reference=recipe.reference(tag or version),
            inside=context.contents(self.root, recipe, self.machine),
            dockerfile=(self.root / recipe.dockerfile).read_bytes(),
            base=self.engine.base(),
            machine=self.machine,
        )

    def _make(self, wanted: Wanted, archive: Path) -> None:
        name = wanted.recipe.name
        for torn in self.folder.glob(f"{name}-*.part"):  # a killed build left it behind
            torn.unlink()
        filled, wheels = self.folder / "contexts" / name, self.folder / "wheels"
        context.fill(filled, self.root, wanted.recipe, wanted.inside, wheels=wheels, machine=self.machine)
        if context.contents(self.root, wanted.recipe, self.machine) != wanted.inside:
            raise ImagesError(f"{name}: its sources changed while they were read; repeat this command")
        dockerfile = filled / "Dockerfile"
        dockerfile.write_bytes(wanted.dockerfile)
        self.engine.build(
            Order(
                reference=wanted.reference,
                dockerfile=dockerfile,
                context=filled,
                arguments=self._arguments(wanted),
                archive=archive,
                log=self.folder / "logs" / f"{name}.log",
            )
        )
        shutil.rmtree(filled)
        cache.prune(self.folder.glob(f"{name}-*.tar"), _KEPT)
        cache.prune(wheels.iterdir(), _KEPT_WHEELS)

    def _arguments(self, wanted: Wanted) -> Mapping[str, str]:
        return {
            "BASE": wanted.base.name,
            **wanted.recipe.arguments,
            "REQUIREMENTS": wanted.inside.requirements.digest,
            **({"EXTRA": wanted.inside.extra.digest} if wanted.inside.extra else {}),
            "PACKAGES": wanted.inside.packages_digest,
            "VERSION": wanted.version,
            "REVISION": _revision(self.root),
        }


def say(text: str) -> None:
    """Print a line to standard error for a person; other programs read standard output."""
    sys.stderr.write(f"images: {text}\n")


def _revision(root: Path) -> str:
    """Return the checked-out commit, with + if files differ from the commit; "unknown" outside of git."""
    commit = programs.answer(["git", "-C", str(root), "rev-parse", "HEAD"], deadline_s=_GIT_DEADLINE_S)
    if commit is None:
        return "unknown"
    changed = programs.answer(["git", "-C", str(root), "status", "--porcelain"], deadline_s=_GIT_DEADLINE_S)
    return f"{commit}+" if changed else commit
