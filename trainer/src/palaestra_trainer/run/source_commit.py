"""Determine the git commit of a job's own code, so that a person can train the policy again.

git runs without a shell, without the repository's programs, and for a bounded time. The commit is unknown if
git is not installed, as in most images, or if the folder is outside of a repository.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

_OURS: Final = __name__.partition(".")[0]
_GIT_S: Final = 5.0
_INSTALLED: Final = {"site-packages", "dist-packages"}
# Without these options, git would take locks, or start the file monitor that the repository names.
_HARMLESS: Final = ("--no-optional-locks", "-c", "core.fsmonitor=false")


def source_commit(environment: str, folder: Path | None = None) -> dict[str, Any] | None:
    """Return the commit of the code of a job's environment; None outside of a git repository.

    Args:
        environment: the id of the environment. If it names a module of the job, that module's folder counts.
        folder: the folder that counts otherwise; by default the working directory.

    Returns:
        `of`, the name of the module or `working directory`; `commit`, as 40 or 64 hexadecimal digits; and
        `dirty`, whether a tracked file has changed since the commit, or the module is not tracked.
    """
    module = environment.partition(":")[0] if ":" in environment else None
    file = None if module is None else _file_of(module)
    place = (folder or Path.cwd()) if file is None else file.parent
    with suppress(OSError, subprocess.SubprocessError):
        head = _git(place, "rev-parse", "--verify", "HEAD^{commit}")
        if head.returncode == 0:
            of = "working directory" if file is None else module
            return {"of": of, "commit": head.stdout.strip(), "dirty": _is_dirty(place, file)}
    return None


def _is_dirty(place: Path, file: Path | None) -> bool:
    # The path `:/` includes the whole repository, because the module may import from other folders of it.
    differs = _git(place, "diff", "--quiet", "--no-ext-diff", "--no-textconv", "HEAD", "--", ":/").returncode
    if differs or file is None:
        return bool(differs)
    return _git(place, "ls-files", "--error-unmatch", "--", file.name).returncode != 0


def _file_of(module: str) -> Path | None:
    """Return the file of a module of the job; None for an installed module, also one of this project."""
    with suppress(ImportError, ValueError):
        spec = importlib.util.find_spec(module)
        if spec is not None and spec.origin is not None and module.partition(".")[0] != _OURS:
            file = Path(spec.origin).resolve()
            if file.is_file() and not _INSTALLED & set(file.parts):
                return file
    return None


def _git(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run git in a folder.

    Raises:
        OSError: git is not installed.
        subprocess.SubprocessError: git did not end in time.
    """
    git = shutil.which("git")
    if git is None:
        raise FileNotFoundError("git")
    # A variable such as GIT_DIR would name another repository than that of the folder.
    kept = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    return subprocess.run(
        [git, *_HARMLESS, "-C", folder, *words],
        check=False,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=_GIT_S,
        env=kept,
    )
