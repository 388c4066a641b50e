"""Drawings and lists in the documentation match the code: error trees, modules and folders."""

from __future__ import annotations

import ast
import re
import subprocess
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "palaestra": ROOT / "operator/src/palaestra",
    "palaestra_protocol": ROOT / "sim_image/src/palaestra_protocol",
    "palaestra_sim": ROOT / "sim_image/src/palaestra_sim",
    "palaestra_trainer": ROOT / "trainer/src/palaestra_trainer",
}
IGNORE = re.compile(r"# (noqa|type: ignore|pyright: ignore|pragma)")
REASON = re.compile(r"# (noqa: [A-Z0-9, ]+ - |type: ignore\[[a-z-]+\](  # noqa: [A-Z0-9]+ - |  # ))\w")
BROAD = re.compile(r" *except(:| [^#]*\b(Base)?Exception\b)")
MOST_LINES = 400
PATH = re.compile(
    r"`((?:[\w.-]+/)+[\w.-]+\.\w+)`"  # a path in backticks that ends with a file suffix
    r"|(?<![\w/.~-])((?:operator|trainer|sim_image|tests|docs|manifests|charts|tools)/[\w./-]*[\w/])"
)
NEW = {"sim_image/src/palaestra_sim/scene/devices/gps.py", "tests/integration/webots/test_gps.py"}
CHANGE = re.compile(r"^ *```diff\n *\+\+\+ (\S+)\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)


def docstring(file):
    """Return the docstring of a package."""
    return ast.get_docstring(ast.parse(file.read_text())) or ""


LISTING = [
    file
    for folder in PACKAGES.values()
    for file in sorted(folder.rglob("__init__.py"))
    if re.search(r"^- `[a-z_]+`", docstring(file), re.MULTILINE)
]
BRANCH = re.compile(r"^(?P<indent>[│ ]*)[├└]── (?P<name>\w+)")


@pytest.mark.parametrize("package", sorted(set(PACKAGES) - {"palaestra_protocol"}))
def test_the_drawn_error_tree_is_that_of_the_classes(package):
    """A caller reads the drawing to decide which error to catch."""
    folder = PACKAGES[package]
    drawing = ast.get_docstring(ast.parse((folder / "errors.py").read_text()))

    root, drawn = tree(drawing)

    assert drawn == descendants(root, bases_of_classes(folder))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_is_in_the_table_of_modules(package):
    """A new contributor looks in this table for the module to change."""
    table = page("docs/architecture.md")
    listed = set(re.findall(rf"^\| `{package}\.([a-z0-9_.]+)` \|", table, re.MULTILINE))
    rooms = {it.parent.name for it in PACKAGES[package].glob("*/__init__.py")}

    assert rooms - {"testing", "cli"} <= listed
    assert all(exists(PACKAGES[package], name) for name in listed)


@pytest.mark.parametrize("file", [pytest.param(file, id=".".join(file.parts[-3:-1])) for file in LISTING])
def test_a_package_that_lists_its_modules_lists_all(file):
    """A new contributor looks for a module in this list, and would not find a module that it lacks."""
    items = re.findall(r"^- (.*)$", docstring(file), re.MULTILINE)
    listed = {name for item in items for name in re.findall(r"`([a-z0-9_]+)`(?=[,:]| and )", item)}
    modules = {path.stem for path in file.parent.glob("*.py")} - {"__init__"}
    rooms = {path.parent.name for path in file.parent.glob("*/__init__.py")}

    assert listed == modules | rooms


def test_the_table_of_folders_names_every_folder_with_something_to_read():
    """The table is for users, so it leaves out `tests/` and `tools/`."""
    listed = re.findall(r"^\| `([a-z_]+)/[^`]*`", page("README.md"), re.MULTILINE)
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    folders = {name.partition("/")[0] for name in tracked.split() if "/" in name and not name.startswith(".")}

    assert set(listed) | {"images"} == folders - {"tests", "tools"}


def test_every_path_that_contributing_names_is_there():
    """New contributors follow CONTRIBUTING.md. If they create a file, only its folder must exist."""
    named = {whole or begun for whole, begun in PATH.findall(page("CONTRIBUTING.md"))}

    assert named >= NEW
    assert [name for name in sorted(named - NEW) if not (ROOT / name).exists()] == []
    assert [name for name in sorted(NEW) if not (ROOT / name).parent.is_dir()] == []


def test_the_lines_around_a_change_in_contributing_are_those_of_its_file():
    """From the lines around a change, a contributor sees where to insert the new line."""
    around = [
        (path, line[1:])
        for path, change in CHANGE.findall(page("CONTRIBUTING.md"))
        for line in textwrap.dedent(change).splitlines()
        if line.startswith(" ")
    ]

    assert around
    assert [(path, line) for path, line in around if line not in page(path).splitlines()] == []


def test_rules_are_ignored_rarely_and_for_a_reason():
    """An ignore comment also hides later mistakes, so each one needs a reason, and few are allowed."""
    sources = [path for folder in PACKAGES.values() for path in folder.rglob("*.py")]
    ignores = [line for path in sources for line in path.read_text().splitlines() if IGNORE.search(line)]

    assert [line for line in ignores if not REASON.search(line)] == []
    assert len(ignores) <= 45


def test_broad_excepts_are_rare_and_have_a_reason():
    """A broad `except` also catches our own mistakes, so its comment must justify it."""
    lines = [line for folder in PACKAGES.values() for file in folder.rglob("*.py") for line in read(file)]
    broad = [line for line in lines if BROAD.match(line)]

    assert [line for line in broad if "# " not in line] == []
    assert len(broad) <= 0.3 * len(lines) / 1000


def test_a_module_fits_into_a_head():
    """A longer module has more than one subject, and its name can lead a reader to only one of them."""
    files = [file for folder in PACKAGES.values() for file in folder.rglob("*.py")]

    assert [file.name for file in files if len(read(file)) > MOST_LINES] == []


def read(file):
    """Return the lines of a file."""
    return file.read_text().splitlines()


def tree(drawing):
    """Return the root of a drawn tree, and the parent of each other class."""
    lines = drawing.splitlines()
    first = next(number for number, line in enumerate(lines) if BRANCH.match(line.lstrip() or " "))
    root = lines[first - 1].split()[0]
    margin = len(lines[first]) - len(lines[first].lstrip())
    parents, drawn = [root], {}
    for line in lines[first:]:
        if match := BRANCH.match(line[margin:]):
            depth = len(match["indent"]) // 4
            drawn[match["name"]] = parents[depth]
            parents[depth + 1 :] = [match["name"]]
    return root, drawn


def bases_of_classes(folder):
    """Return the names of the base classes of each class in the modules of a folder."""
    modules = [ast.parse(path.read_text()) for path in folder.rglob("*.py")]
    classes = [node for module in modules for node in ast.walk(module) if isinstance(node, ast.ClassDef)]
    return {node.name: [ast.unparse(base).rpartition(".")[2] for base in node.bases] for node in classes}


def descendants(root, bases):
    """Return the parent of every class that derives from `root`."""
    found, parents = {}, {root}
    while parents:
        found |= (new := {name: base for name, given in bases.items() for base in given if base in parents})
        parents = set(new)
    return found


def exists(package, name):
    """Return whether a dotted name is a module or package in `package`."""
    path = package.joinpath(*name.split("."))
    return path.is_dir() or path.with_suffix(".py").is_file()


def page(name):
    """Return the text of a page."""
    return (ROOT / name).read_text()
