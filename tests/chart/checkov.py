"""checkov in an environment of its own, because checkov pins older libraries than the project.

The first call installs the packages of checkov.lock, which `make lock` writes, into the project's cache. A
scan opens no connection.
"""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from tools.images import cache

LOCK = Path(__file__).with_name("checkov.lock")
UV = Path(sys.executable).with_name("uv")
INSTALL_S, SCAN_S = 240, 60
KEPT = 2  # number of environments in the cache; another checkout may have another lock file


class Finding(NamedTuple):
    """A check that failed, such as CKV_K8S_11, and the object for which it failed."""

    check: str
    kind: str
    name: str


def findings(manifests: Mapping[str, str]) -> dict[str, set[Finding]]:
    """Return checkov's findings by the name of the manifest; a manifest is YAML text.

    Raises:
        CalledProcessError: checkov failed or could not be installed.
    """
    with TemporaryDirectory() as folder:
        for name, text in manifests.items():
            Path(folder, f"{name}.yaml").write_text(text)
        options = ("--framework=kubernetes", "--output=json", "--compact", "--soft-fail", "--skip-download")
        scan = [_environment() / "bin/python", "-m", "checkov.main", f"--directory={folder}", *options]
        surroundings = {"HOME": folder, "PATH": os.environ["PATH"]}
        said = subprocess.run(scan, env=surroundings, check=True, capture_output=True, timeout=SCAN_S).stdout
    results = json.loads(said)["results"]
    assert not results["parsing_errors"]
    found: dict[str, set[Finding]] = {name: set() for name in manifests}
    for failed in results["failed_checks"]:
        kind, *_, name = failed["resource"].split(".")
        found[Path(failed["file_path"]).stem].add(Finding(failed["check_id"], kind, name))
    return found


def _environment() -> Path:
    """Return the environment, and create it if it is missing.

    The creation is atomic, because another process may create the same environment.
    """
    made = cache.folder() / f"checkov-{hashlib.sha256(LOCK.read_bytes()).hexdigest()[:12]}"
    made.parent.mkdir(parents=True, exist_ok=True)
    if not made.is_dir():
        with TemporaryDirectory(dir=made.parent, ignore_cleanup_errors=True) as folder:
            part = Path(folder, "environment")
            _uv("venv", f"--python={sys.executable}", part)
            _uv("pip", "install", "--require-hashes", f"--python={part}", f"--requirements={LOCK}")
            with suppress(OSError):  # another process has created it
                part.rename(made)
    cache.use(made)
    cache.prune(made.parent.glob("checkov-*"), KEPT)
    return made


def _uv(*arguments: str | Path) -> None:
    subprocess.run([UV, *arguments, "--quiet"], check=True, timeout=INSTALL_S)
