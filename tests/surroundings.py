"""The same signals, locale and limits for all programs that tests start, however pytest was started.

A shell starts a command in the background of a script with SIGINT ignored, nohup ignores SIGHUP, and a user
may have any locale, time zone, umask and limit of open files. Programs inherit all of these.
"""

import os
import resource
import signal

LOCALE = "C.UTF-8"
TIME_ZONE = "UTC"
UMASK = 0o022
OPEN_FILES = 1024
# These variables change the output of a program, or the folders in which the program keeps files.
UNSET = (
    "COLUMNS", "FORCE_COLOR", "LANGUAGE", "LINES", "MAKEFLAGS", "MAKELEVEL", "MFLAGS", "NO_COLOR",
    "PYTHONDONTWRITEBYTECODE", "ROS_HOSTNAME", "ROS_IP", "ROS_MASTER_URI", "ROS_NAMESPACE", "ROS_LOG_DIR",
)  # fmt: skip


def settle() -> None:
    """Set the same signals, locale, time zone, umask and limit of open files for all programs."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    for name in UNSET:
        os.environ.pop(name, None)
    for name in [name for name in os.environ if name.startswith("LC_")]:
        del os.environ[name]
    os.environ |= {"LANG": LOCALE, "TERM": "dumb", "TZ": TIME_ZONE}
    os.umask(UMASK)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft < OPEN_FILES:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(OPEN_FILES, hard), hard))
