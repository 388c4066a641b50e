"""An image has the locked versions of the packages that it needs, and no other packages."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools.images.context import contents
from tools.images.lock import parse, share, unwanted
from tools.images.recipes import left_out, recipes

ROOT = Path(__file__).parents[3]
LOCK = parse((ROOT / "requirements.lock").read_text())
SMALL = """\
child==1.0 \\
    --hash=sha256:aa \\
    --hash=sha256:bb
    # via parent
new-python-only==2.0 ; python_full_version >= '3.12' \\
    --hash=sha256:cc
    # via parent
old-python-only==2.0 ; python_full_version < '3.12' \\
    --hash=sha256:dd
    # via parent
parent==3.1 \\
    --hash=sha256:ee
    # via
    #   palaestra (operator/pyproject.toml)
    #   stranger
stranger==4.0 \\
    --hash=sha256:ff

# The following packages were excluded from the output:
# palaestra-sim
"""


def names(requirements):
    """Return the package names in a requirements file."""
    return set(re.findall(r"^([a-z0-9-]+)==", requirements, re.MULTILINE))


def test_a_share_holds_what_is_needed_also_by_way_of_others():
    """Palaestra requires `parent`, and only `parent` requires `child`."""
    assert {"parent", "child"} <= names(share(parse(SMALL), ["palaestra"], "x86_64"))


def test_a_share_holds_nothing_that_only_others_need():
    """Linters and test tools must not be in an image."""
    assert "stranger" not in names(share(parse(SMALL), ["palaestra"], "x86_64"))


def test_markers_are_decided_for_the_python_of_the_image():
    """The machine that builds the image may have another Python version."""
    chosen = names(share(parse(SMALL), ["palaestra"], "x86_64"))

    assert "new-python-only" in chosen
    assert "old-python-only" not in chosen


def test_what_is_left_out_takes_along_what_only_it_needs():
    """Debian's PyTorch replaces the locked PyTorch, whose libraries are then not needed either."""
    assert names(share(parse(SMALL), ["palaestra"], "x86_64", without=["parent"])) == set()


def test_what_a_package_does_not_want_stays_where_another_wants_it():
    """Another package requires `parent` too, so `parent` stays in that package's share."""
    pins = unwanted(parse(SMALL), "palaestra", ["parent"])

    assert names(share(pins, ["palaestra"], "x86_64")) == set()
    assert "parent" in names(share(pins, ["stranger"], "x86_64"))


def test_an_image_without_an_extra_has_nothing_that_only_the_extra_wants():
    """Packages that are also required without the extra stay in the image."""
    package = {
        "dependencies": ["always>=1"],
        "optional-dependencies": {"camera": ["PyOpenGL>=3", "always"], "sound": ["horn"]},
    }

    assert left_out(package, ()) == {"pyopengl", "horn"}
    assert left_out(package, ("camera",)) == {"horn"}


def test_a_share_keeps_every_hash():
    """With the hashes, the installer refuses a wheel that differs from the locked one."""
    requirements = share(parse(SMALL), ["palaestra"], "x86_64")

    assert "child==1.0 \\\n    --hash=sha256:aa \\\n    --hash=sha256:bb\n" in requirements


def test_a_lock_of_another_form_is_refused_with_the_line():
    """If the parser skipped an unknown line, the image would lack the package of that line."""
    with pytest.raises(ValueError, match=r"'child @ file:///child' has no version with hashes"):
        parse("child @ file:///child\n    # via palaestra\n")


@given(st.lists(st.sampled_from(["palaestra", "palaestra-sim", "palaestra-trainer"]), unique=True))
def test_a_share_of_the_real_lock_is_again_a_lock_with_the_same_content(packages):
    """The written text parses to the same versions and hashes."""
    pins = {pin.name: pin for pin in LOCK if "python_full_version <" not in (pin.marker or "")}
    for pin in parse(share(LOCK, packages, "x86_64")):
        assert pin.hashes == pins[pin.name].hashes
        assert pin.version == pins[pin.name].version


@pytest.mark.parametrize(
    ("image", "holds", "lacks"),
    [
        ("stub", {"prometheus-client", "pillow"}, {"mujoco-core", "numpy", "pydantic", "torch", "pytest"}),
        (
            "mujoco",
            {"av", "mujoco-core", "numpy", "pillow", "pyopengl", "prometheus-client"},
            {"pydantic", "torch"},
        ),
        (
            "operator",
            {"pydantic", "structlog", "prometheus-client"},
            {"mujoco-core", "numpy", "torch", "pytest"},
        ),
        (
            "trainer",
            {"numpy", "stable-baselines3", "gymnasium", "pydantic", "hatchling", "uv", "wheel"},
            {"mujoco-core", "torch", "triton", "pytest"},
        ),
    ],
)
def test_an_image_has_its_own_share_of_the_real_lock(image, holds, lacks):
    """The sidecar's image stays small, and the trainer's CPU image does not contain 5 GB of CUDA."""
    chosen = names(contents(ROOT, recipes("debian")[image], "x86_64").requirements.text)

    assert holds <= chosen
    assert not lacks & chosen


def test_what_the_notebook_has_besides_agrees_with_the_lock():
    """The notebook's image adds packages, but must keep the tested versions of the trainer's libraries."""
    here, besides = (
        {pin.name: pin.version for pin in parse(share(pins, [pin.name for pin in pins], "x86_64"))}
        for pins in (LOCK, parse((ROOT / recipes("debian")["notebook"].extra).read_text()))
    )
    both = here.keys() & besides.keys()

    assert "jupyterlab" in besides.keys() - here.keys()
    assert {name: besides[name] for name in both} == {name: here[name] for name in both}


def test_what_an_image_has_besides_is_nothing_that_it_has_already():
    """A package must be downloaded only once, and must be in only one layer."""
    inside = contents(ROOT, recipes("debian")["notebook"], "x86_64")

    assert names(inside.requirements.text)
    assert names(inside.extra.text)
    assert not names(inside.requirements.text) & names(inside.extra.text)


def test_the_trainer_for_cuda_has_the_locked_torch_and_its_libraries():
    """Debian's PyTorch has no CUDA, so this image needs the locked PyTorch."""
    recipe = recipes("cuda")["trainer"]

    assert {"torch", "triton", "nvidia-cudnn-cu12"} <= names(
        share(LOCK, ["palaestra-trainer"], "x86_64", recipe.without)
    )
