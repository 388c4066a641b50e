"""The first minutes of a new user: from a clone to a trained policy, without caches."""

import os
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
CACHES = {"PALAESTRA_CACHE", "PIP_CACHE_DIR", "UV_CACHE_DIR", "VIRTUAL_ENV", "XDG_CACHE_HOME"}


def measure(scale=1.0):
    """Return the seconds of the installation, and the seconds until `make run` has ended.

    An installation takes minutes. So at scale 0, only `make help` runs in the clone.
    """
    install, train = ("setup", "run") if scale else ("help", "help")
    with tempfile.TemporaryDirectory() as folder:
        clone, home = Path(folder, "palaestra"), Path(folder, "home")
        home.mkdir()
        subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
        began = time.monotonic()
        make(install, clone, home)
        installed = time.monotonic()
        make(train, clone, home)
        ended = time.monotonic()
    return {"seconds_installing": round(installed - began), "seconds_to_the_policy": round(ended - began)}


def make(verb, clone, home):
    """Run a make target of the clone in an environment without caches."""
    kept = {name: value for name, value in os.environ.items() if name not in CACHES}
    subprocess.run(
        ["make", verb], cwd=clone, env={**kept, "HOME": home}, check=True, stdout=subprocess.DEVNULL
    )
