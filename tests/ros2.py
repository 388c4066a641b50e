"""rclpy in an environment of its own, and programs of ROS 2 whose packets stay on this machine.

The first call installs the wheels of ros2.lock, which `make lock` writes, into the project's cache. All
programs of a test run share a ROS domain, and their DDS has only shared memory as a transport, so they open
no socket of a network.
"""

import hashlib
import os
import subprocess
import sys
import sysconfig
from contextlib import suppress
from functools import cache as once
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tools.images import cache

ROOT = Path(__file__).parents[1]
LOCK = Path(__file__).with_name("ros2.lock")
UV = Path(sys.executable).with_name("uv")
INSTALL_S = 240
KEPT = 2  # number of environments in the cache; another checkout may have another lock file
DOMAINS = 100


def start(*words, **options):
    """Start a Python program with rclpy and this project's packages, and return its process."""
    command = [python(), *map(str, words)]
    return subprocess.Popen(command, env=surroundings(), text=True, cwd=ROOT, **options)


def surroundings():
    """Return the environment variables of a program of ROS 2."""
    # A library that is in both environments, such as NumPy, has the same version in both.
    paths = [ROOT / "trainer/src", ROOT / "sim_image/src", ROOT, sysconfig.get_path("purelib")]
    return os.environ | {
        "FASTDDS_BUILTIN_TRANSPORTS": "SHM",
        "PYTHONPATH": os.pathsep.join(map(str, paths)),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        # With any other range, ROS adds transports of its own, which open sockets.
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
        "ROS_DOMAIN_ID": str(1 + os.getpid() % DOMAINS),
    }


@once
def python():
    """Return the interpreter of the environment, which is created if it is missing; skip if that fails.

    The creation is atomic, because another process may create the same environment.
    """
    made = cache.folder() / f"ros2-{hashlib.sha256(LOCK.read_bytes()).hexdigest()[:12]}"
    made.parent.mkdir(parents=True, exist_ok=True)
    if not made.is_dir():
        with TemporaryDirectory(dir=made.parent, ignore_cleanup_errors=True) as folder:
            part = Path(folder, "environment")
            try:
                _uv("venv", "--no-project", f"--python={sys.executable}", part)
                _uv("pip", "install", "--require-hashes", f"--python={part}", f"--requirements={LOCK}")
            except subprocess.CalledProcessError as error:
                pytest.skip(
                    f"the wheels of rclpy cannot be installed: {error.stderr.strip().splitlines()[0]}"
                )
            with suppress(OSError):  # another process has created it
                part.rename(made)
    cache.use(made)
    cache.prune(made.parent.glob("ros2-*"), KEPT)
    return made / "bin/python"


def _uv(*arguments):
    subprocess.run([UV, *arguments, "--quiet"], check=True, capture_output=True, text=True, timeout=INSTALL_S)
