"""The digest in an archive's name covers all content of the image."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools.images.recipes import digest, digest_of_files, recipes, sources

ROOT = Path(__file__).parents[3]


@given(st.lists(st.binary(max_size=4)), st.lists(st.binary(max_size=4)))
def test_different_parts_have_different_digests(one, other):
    """The boundaries between the parts count: (a, bc) and (ab, c) have different digests."""
    assert (digest(one) == digest(other)) == (one == other)


def test_a_changed_file_changes_the_digest(tmp_path):
    """After a change of the sources, no test may run an old image."""
    file = tmp_path / "module.py"
    file.write_text("1")
    before = digest_of_files(tmp_path, [file])
    file.write_text("2")

    assert digest_of_files(tmp_path, [file]) != before


def test_a_renamed_file_changes_the_digest(tmp_path):
    """A renamed file is a Python module of another name."""
    one, other = tmp_path / "one.py", tmp_path / "other.py"
    one.write_text("1")
    before = digest_of_files(tmp_path, [one])
    one.rename(other)

    assert digest_of_files(tmp_path, [other]) != before


def test_the_place_of_the_checkout_does_not_change_the_digest(tmp_path):
    """Two checkouts with the same content share one archive."""
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "module.py").write_text("1")

    assert digest_of_files(tmp_path / "one", [tmp_path / "one" / "module.py"]) == digest_of_files(
        tmp_path / "other", [tmp_path / "other" / "module.py"]
    )


def test_what_python_leaves_behind_changes_nothing(tmp_path):
    """A test run writes bytecode, which must not cause a new build of every image."""
    source = tmp_path / "package" / "src" / "module.py"
    source.parent.mkdir(parents=True)
    source.write_text("1")
    cached = source.parent / "__pycache__" / "module.cpython-313.pyc"
    cached.parent.mkdir()
    cached.write_bytes(b"\0")

    assert cached not in set(sources(tmp_path, "package"))
    assert source in set(sources(tmp_path, "package"))


@pytest.mark.parametrize("recipe", recipes("debian").values(), ids=lambda recipe: recipe.name)
def test_a_recipe_names_what_is_there(recipe):
    """This test finds a wrong path at once, but a build would fail only after minutes."""
    assert (ROOT / recipe.dockerfile).is_file()
    assert all((ROOT / file).is_file() for file in recipe.files)
    assert all((ROOT / package / "pyproject.toml").is_file() for package in recipe.packages)


def test_an_image_has_the_name_that_the_plan_asks_for():
    """The plan's names have no registry, and a container engine adds `docker.io/library` to them."""
    from palaestra.plan import Images  # noqa: PLC0415 - only this test needs it

    images = Images.of_release("1.2.3")

    assert recipes("debian")["stub"].reference("1.2.3") == f"docker.io/library/{images.stub}"
    assert recipes("debian")["mujoco"].reference("1.2.3") == f"docker.io/library/{images.mujoco}"
    assert recipes("debian")["trainer"].reference("1.2.3") == f"docker.io/library/{images.trainer}"
