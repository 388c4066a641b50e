"""Find modules of a user that shadow modules of Python or of Palaestra's dependencies.

Python searches the folders of PYTHONPATH and the folder of a script before the standard library. If such a
folder holds a `queue.py`, all libraries import that file instead of Python's `queue`. The libraries then fail
with a traceback that does not name the user's file.

A program that runs no code of the user moves these folders to the end of the search path. Any other program
exits with an error, because the user's code may need its own `queue` while the libraries need Python's.

This module must not import a shadowed module itself. So it imports only built-in and frozen modules until it
has checked the standard library.
"""

import os
import sys
from _frozen_importlib import BuiltinImporter, FrozenImporter, ModuleSpec
from _frozen_importlib_external import PathFinder

_WITH_CODE_OF_USERS = (
    *("palaestra-train", "palaestra-eval", "palaestra-export", "palaestra-compare", "palaestra-try"),
)
_WRONG_INPUT = 2
_OURS = ("palaestra", "palaestra-sim", "palaestra-trainer")
# Modules that are not in the metadata of an installed package: our own in a checkout, those of Debian's
# packages, and webots_ros, which we generate.
_UNNAMED = (
    *("palaestra", "palaestra_protocol", "palaestra_sim", "palaestra_trainer"),
    *("rospy", "rosgraph", "rosmaster", "roslib", "rospkg", "genpy", "genmsg", "catkin_pkg", "webots_ros"),
    *("rosgraph_msgs", "roscpp", "std_msgs", "sensor_msgs", "geometry_msgs", "netifaces", "defusedxml"),
)


def settle_imports() -> None:
    """Make sure that imports in this process find the right modules; our packages call this function first.

    Raises:
        ImportError: a module of the user shadows a module that Palaestra needs.
        SystemExit: the same mistake in a program of Palaestra; the program prints the reason first.
    """
    program = _program()
    if _is_ours(program) and program not in _WITH_CODE_OF_USERS:
        _import_last(_ahead())
        return
    if program in _WITH_CODE_OF_USERS and not sys.flags.safe_path:
        _put_last(sys.path[:1])  # the folder of the script itself
    folders = _ahead()
    reasons = [reason for name, reason in _shadows(folders, _others(folders)) if not _loaded(name, folders)]
    if reasons and program in _WITH_CODE_OF_USERS:
        sys.stderr.write("".join(f"{program}: {reason}\n" for reason in reasons))
        raise SystemExit(_WRONG_INPUT)
    if reasons:
        raise ImportError("\n".join(reasons))


def shadows(python_path: str) -> list[str]:
    """Return a line for each module that `python_path` would shadow in a new process, with the remedy."""
    folders = [os.path.abspath(folder) for folder in python_path.split(os.pathsep)] if python_path else []
    return [reason for _, reason in _shadows(folders, _others([*folders, *_ahead()]))]


def _program() -> str:
    """Return the name of this process's program; for `python -m`, the name of the module."""
    if sys.argv[:1] == ["-m"] and "-m" in sys.orig_argv:
        return sys.orig_argv[sys.orig_argv.index("-m") + 1]
    return os.path.basename(sys.argv[0]) if sys.argv else ""


def _is_ours(program: str) -> bool:
    name = program.removeprefix("kubectl-")
    return name == "palaestra" or name.startswith(("palaestra-", "palaestra.", "palaestra_"))


def _ahead() -> list[str]:
    """Return the folders that come before the standard library in this process."""
    library = os.path.dirname(os.__file__)
    if library not in sys.path:
        return []
    found = sys.path[: sys.path.index(library)]
    return [folder for folder in found if not folder.endswith(".zip") or os.path.exists(folder)]


def _import_last(folders: list[str]) -> None:
    """Import from these folders last, and unload modules that Python's startup imported from them."""
    _put_last(folders)
    others = _others(folders)
    for name, file, _ in [each for folder in folders for each in _hidden(folder, others)]:
        if name in sys.modules and getattr(sys.modules[name], "__file__", None) == file:
            _forget(name)
        if name in sys.stdlib_module_names and _spec(name, others) is None:
            vars(sys)["modules"][name] = None  # this system lacks the module, so make its import fail


def _forget(name: str) -> None:
    """Unload a module, and each module of the standard library that references it.

    The next import loads them again.
    """
    module = sys.modules.pop(name)
    library = os.path.dirname(os.__file__)
    for other, holder in list(sys.modules.items()):
        file = getattr(holder, "__file__", None) or ""
        if os.path.dirname(file) == library and any(value is module for value in vars(holder).values()):
            _forget(other)


def _put_last(folders: list[str]) -> None:
    sys.path[:] = [*_others(folders), *folders]


def _others(folders: list[str]) -> list[str]:
    return [folder for folder in sys.path if folder not in folders]


def _shadows(folders: list[str], others: list[str]) -> list[tuple[str, str]]:
    """Return the name of each shadowed module, and a message with file, fact and remedy."""
    found = [each for folder in folders for each in _hidden(folder, others)]
    library = [
        (name, f"{file}: shadows the module {name} of Python's standard library; rename it")
        for name, file, _ in found
        if name in sys.stdlib_module_names
    ]
    # `_is_needed` imports many modules of the standard library. So the function runs only if no such module
    # is shadowed.
    return library or [
        (name, f"{file}: shadows the module {name}, which Palaestra needs; rename it")
        for name, file, folder in found
        if not _holds_installed(folder) and _is_needed(name, others)
    ]


def _hidden(folder: str, others: list[str]) -> list[tuple[str, str, str]]:
    """Return name, file and folder of each module in `folder` that shadows a module in `others`."""
    try:
        names = {file.partition(".")[0] for file in os.listdir(folder or os.curdir)}
    except OSError:  # Python also ignores a folder that it cannot read
        return []
    found = []
    for name in sorted(filter(str.isidentifier, names)):
        mine, other = _spec(name, [folder]), _spec(name, others)
        if not (mine and mine.origin):  # a folder without `__init__.py` does not shadow a module
            continue
        # Some modules of the standard library, such as msvcrt, exist only on other systems. The library tries
        # to import them to recognize the system. So a user's module with such a name counts as shadowing too.
        if name in sys.stdlib_module_names if other is None else not _same(mine.origin, other.origin):
            found.append((name, mine.origin, folder))
    return found


def _spec(name: str, folders: list[str]) -> ModuleSpec | None:
    """Return the import spec of a module in these folders; None if absent, or built into Python."""
    if BuiltinImporter.find_spec(name) or FrozenImporter.find_spec(name):
        return None
    return PathFinder.find_spec(name, folders)


def _same(file: str, other: str | None) -> bool:
    return other is not None and os.path.realpath(file) == os.path.realpath(other)


def _loaded(name: str, folders: list[str]) -> bool:
    """Return whether this process has already imported the module from a folder outside `folders`."""
    origin = getattr(getattr(sys.modules.get(name), "__spec__", None), "origin", None)
    mine = _spec(name, folders)
    return origin is not None and mine is not None and origin != mine.origin


def _holds_installed(folder: str) -> bool:
    """Return whether a folder holds installed packages; a user chose their versions on purpose."""
    return any(name.endswith((".dist-info", ".egg-info")) for name in os.listdir(folder or os.curdir))


def _is_needed(name: str, folders: list[str]) -> bool:
    """Return whether a module belongs to a package that Palaestra needs, directly or indirectly."""
    from importlib.metadata import distributions

    installed = {_normal(each.name): each for each in distributions(path=folders)}
    wanted, needed = list(_OURS), set[str]()
    while wanted:
        package = wanted.pop()
        if package in installed and package not in needed:
            needed.add(package)
            wanted += _requirements(installed[package].requires or [], with_extras=package in _OURS)
    files = (str(file) for package in needed for file in installed[package].files or ())
    return name in _UNNAMED or any(file.partition("/")[0].partition(".")[0] == name for file in files)


def _requirements(lines: list[str], *, with_extras: bool) -> list[str]:
    import re

    kept = [line for line in lines if with_extras or "extra ==" not in line]
    return [_normal(match[0]) for match in map(re.compile(r"[\w.-]+").match, kept) if match]


def _normal(name: str) -> str:
    return name.lower().replace("_", "-").replace(".", "-")
