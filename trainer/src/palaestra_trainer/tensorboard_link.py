"""The name under which TensorBoard shows a run that lies on a claim.

There a run lies at `<uid>/<replica>`, and a UID means nothing to a reader. TensorBoard names a run by the
path on which it finds it, so a link `tensorboard/<job>-<first 8 of the UID>/<replica>` at the top of the
claim leads to the run's curves. The run does not move: resumes, warm starts and `palaestra fetch` find it
by its UID.

Training needs no link. An error is logged once and ends nothing.
"""

from __future__ import annotations

import os
import stat
from contextlib import ExitStack, suppress

import structlog

from palaestra_trainer.configuration import Configuration
from palaestra_trainer.run_directory import RunDirectory

log = structlog.get_logger(__name__)

FOLDER = "tensorboard"  # the chart's value tensorboard.folder has the same default


def link_curves(directory: RunDirectory, configuration: Configuration) -> None:
    """Make the link, unless it exists or the run lies on no claim.

    `palaestra run` keeps a run at `<dir>/<job>/<replica>`, which names the job without a link.
    """
    run, uid = directory.path, configuration.uid
    if not uid or (run.parent.name, run.name) != (uid, str(configuration.replica)):
        return
    job = f"{configuration.job}-{uid[:8]}"
    target = f"../../{uid}/{run.name}/{directory.tensorboard.name}"  # TensorBoard mounts the claim elsewhere
    try:
        with ExitStack() as stack:
            volume = os.open(run.parent.parent, os.O_RDONLY | os.O_DIRECTORY)
            stack.callback(os.close, volume)
            _link(run.name, target, _folder(job, _folder(FOLDER, volume, stack), stack))
    except OSError as error:
        log.warning("run not linked for TensorBoard", link=f"{FOLDER}/{job}/{run.name}", error=str(error))


def _folder(name: str, parent: int, stack: ExitStack) -> int:
    """Return the descriptor of a folder in an open folder; a missing one is made.

    Other jobs write to the claim too. A job that puts a link in the place of a folder must not choose where
    this process writes, so a link is refused here, and a descriptor stays on the folder that was opened.
    """
    with suppress(FileExistsError):
        os.mkdir(name, dir_fd=parent)
    descriptor = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=parent)
    stack.callback(os.close, descriptor)
    return descriptor


def _link(name: str, target: str, folder: int) -> None:
    """Let `name` in an open folder lead to `target`; replace a link that leads elsewhere.

    A link appears whole or not at all. It needs no temporary name, which TensorBoard could show as a run.

    Raises:
        OSError: the file system has no links, or something that is no link has the name.
    """
    try:
        os.symlink(target, name, dir_fd=folder)
    except FileExistsError:
        if not stat.S_ISLNK(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
            raise
        if os.readlink(name, dir_fd=folder) != target:
            os.unlink(name, dir_fd=folder)
            os.symlink(target, name, dir_fd=folder)
