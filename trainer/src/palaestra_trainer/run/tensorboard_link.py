"""Create the link that gives a run on a claim a readable name in TensorBoard.

On a claim, the folder of a run is `<uid>/<replica>`, and TensorBoard names a run by its path. A person does
not recognize a UID. So a link `tensorboard/<job>-<first 8 of the UID>/<replica>` at the top of the claim
points to the run's curves. The folder of the run keeps its path, because resumes, warm starts and `palaestra
fetch` find the run by its UID.

Training does not need the link, so an error is only logged.
"""

from __future__ import annotations

import os
import stat
from contextlib import ExitStack, suppress

import structlog

from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory

log = structlog.get_logger(__name__)

FOLDER = "tensorboard"  # the chart's value tensorboard.folder has the same default


def link_curves(directory: RunDirectory, configuration: Configuration) -> None:
    """Create the link if it is missing and the run is on a claim.

    Runs of `palaestra run` need no link, because their path `<dir>/<job>/<replica>` contains the job's name.
    """
    run, uid = directory.path, configuration.uid
    if not uid or (run.parent.name, run.name) != (uid, str(configuration.replica)):
        return
    job = f"{configuration.job}-{uid[:8]}"
    # The target is relative, because TensorBoard mounts the claim at another path.
    target = f"../../{uid}/{run.name}/{directory.tensorboard.name}"
    try:
        with ExitStack() as stack:
            volume = os.open(run.parent.parent, os.O_RDONLY | os.O_DIRECTORY)
            stack.callback(os.close, volume)
            _link(run.name, target, _folder(job, _folder(FOLDER, volume, stack), stack))
    except OSError as error:
        log.warning("run not linked for TensorBoard", link=f"{FOLDER}/{job}/{run.name}", error=str(error))


def _folder(name: str, parent: int, stack: ExitStack) -> int:
    """Return a descriptor of a folder inside the open folder `parent`; create the folder if it is missing.

    Other jobs write to the claim too. A job could replace a folder by a link, to make this process write into
    another folder. So this function refuses links. A descriptor always refers to the folder that was opened.
    """
    with suppress(FileExistsError):
        os.mkdir(name, dir_fd=parent)
    descriptor = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=parent)
    stack.callback(os.close, descriptor)
    return descriptor


def _link(name: str, target: str, folder: int) -> None:
    """Create a link `name` to `target` in an open folder; replace an existing link with another target.

    The link has no temporary name during its creation, because TensorBoard could show that name as a run.

    Raises:
        OSError: the file system does not support links, or the name exists and is not a link.
    """
    try:
        os.symlink(target, name, dir_fd=folder)
    except FileExistsError:
        if not stat.S_ISLNK(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
            raise
        if os.readlink(name, dir_fd=folder) != target:
            os.unlink(name, dir_fd=folder)
            os.symlink(target, name, dir_fd=folder)
