"""An image is built only if its content is new."""

import shutil
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from tools.images import cache
from tools.images.building import Workshop
from tools.images.engines import Base
from tools.images.errors import ImagesError
from tools.images.recipes import recipes

ROOT = Path(__file__).parents[3]
OPERATOR = recipes("debian")["operator"]

EDITS_WHILE_BUILDING = """
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Editor(BuildHookInterface):
    def initialize(self, version, build_data):
        Path(self.root, "src", "palaestra", "errors.py").write_text("")
"""


@dataclass
class WritingEngine:
    """An engine that builds no image: it writes the arguments of the order into the archive."""

    digest: str = "sha256:base"
    orders: list = field(default_factory=list)

    def base(self):
        """Return the base image."""
        return Base(name="debian", digest=self.digest)

    def build(self, order):
        """Check the build context, which exists only during the build, and write the archive."""
        self.orders.append(order)
        assert (order.context / "requirements.txt").is_file()
        assert list((order.context / "packages").glob("palaestra-*.whl"))
        order.archive.write_text(repr(order.arguments))


@pytest.fixture
def root(tmp_path):
    """Return a copy of the sources of the operator's image, with a lock file without packages."""
    for package in OPERATOR.packages:
        copied = tmp_path / "checkout" / package
        shutil.copytree(ROOT / package, copied, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "checkout" / "requirements.lock").write_text("# nothing is needed\n")
    return tmp_path / "checkout"


@pytest.fixture
def engine():
    """Return an engine that only records its orders."""
    return WritingEngine()


@pytest.fixture
def workshop(root, engine, tmp_path):
    """Return a workshop with an empty folder for archives."""
    return Workshop(root=root, engine=engine, folder=tmp_path / "images")


def test_an_unchanged_image_is_not_built_again(workshop, engine):
    """Each run of the cluster tests requests the images, and a build takes minutes."""
    first, second = workshop.build(OPERATOR), workshop.build(OPERATOR)

    assert len(engine.orders) == 1
    assert first == second


def test_an_archive_keeps_its_age_when_it_is_used(workshop):
    """A test cluster compares the modification time to find out whether it must load the archive."""
    before = workshop.build(OPERATOR).archive.stat().st_mtime_ns

    assert workshop.build(OPERATOR).archive.stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "changed",
    ["operator/Dockerfile", "operator/pyproject.toml", "sim_image/src/palaestra_sim/errors.py"],
)
def test_a_changed_file_makes_another_archive(workshop, root, engine, changed):
    """After a change of the sources, no test may run an old image."""
    first = workshop.build(OPERATOR)
    file = root / changed
    file.write_text(f"{file.read_text()}\n# changed\n")
    second = workshop.build(OPERATOR)

    assert first.archive != second.archive
    assert len(engine.orders) == 2


def test_a_file_of_the_builder_s_own_is_in_the_context(workshop, engine, tmp_path):
    """The Dockerfile of Webots reads an archive that is not in the checkout."""
    given = tmp_path / "download.zip"
    given.write_text("given")
    found = []
    build, engine.build = engine.build, lambda order: found.append((order.context / "own.zip").read_text())

    workshop.build(replace(OPERATOR, given={"own.zip": given}))
    engine.build = build

    assert found == ["given"]


def test_a_changed_lock_of_its_own_makes_another_archive(workshop, root, engine):
    """Besides the lock file of all images, an image may have a lock file of its own."""
    recipe = replace(OPERATOR, extra="extra.lock")
    (root / "extra.lock").write_text("# nothing is needed\n")
    without = workshop.build(OPERATOR)
    first = workshop.build(recipe)

    assert first.archive != without.archive
    assert [order.arguments.get("EXTRA") is None for order in engine.orders] == [True, False]


def test_another_base_makes_another_archive(workshop, engine):
    """A security update of Debian's image must cause a new build of this project's images."""
    first = workshop.build(OPERATOR)
    engine.digest = "sha256:newer"

    assert workshop.build(OPERATOR).archive != first.archive


def test_a_tag_is_part_of_the_content(workshop):
    """The tests of an upgrade use the same image under two tags."""
    built = workshop.build(OPERATOR, "0.0.0-next")

    assert built.reference == "docker.io/library/palaestra-operator:0.0.0-next"
    assert workshop.build(OPERATOR).archive != built.archive


def test_the_context_is_gone_after_the_build(workshop, engine):
    """With PyTorch among its wheels, a build context has several gigabytes, which would fill the disk."""
    workshop.build(OPERATOR)

    assert not engine.orders[0].context.exists()


def test_sources_that_change_while_they_are_read_are_refused(workshop, root):
    """Without this error the archive's content would not match the digest in its name."""
    package = root / "operator"
    (package / "hatch_build.py").write_text(EDITS_WHILE_BUILDING)
    with (package / "pyproject.toml").open("a") as project:
        project.write("\n[tool.hatch.build.hooks.custom]\n")

    with pytest.raises(ImagesError, match="operator: its sources changed while they were read; repeat this"):
        workshop.build(OPERATOR)


def test_archives_that_nobody_used_for_long_are_removed(tmp_path):
    """An archive has about a gigabyte, so old archives would fill the disk."""
    for name in "abc":
        (tmp_path / name).touch()
    cache.use(tmp_path / "a")
    cache.prune(tmp_path.iterdir(), kept=1)

    assert [path.name for path in tmp_path.iterdir()] == ["a"]
