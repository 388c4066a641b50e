"""Each file of a checkpoint is damaged in turn; the trainer must detect it and use the older checkpoint."""

import shutil
import tempfile
from pathlib import Path

from tests.local_run import LocalRun
from tests.soak.jobs import LITTLE_DQN, tiny_job

STEPS = 1000
CHECKPOINT_STEPS = 200
NOTICED = "damaged checkpoint skipped"


def flip(file):
    """Change one byte in the middle of a file, as a faulty disk does."""
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0xFF
    replace(file, bytes(content))


def cut(file):
    """Remove the second half of a file, as a full disk does."""
    replace(file, file.read_bytes()[: file.stat().st_size // 2])


def remove(file):
    """Remove the file."""
    file.unlink()


def replace(file, content):
    """Replace a file by a new one with this content.

    Checkpoints may share an unchanged file by hard links, and only one checkpoint is to be damaged.
    """
    file.unlink()
    file.write_bytes(content)


DAMAGES = (flip, cut, remove)


def measure(scale):
    """Return the files, the kinds of damage, and the damages that the trainer did not detect."""
    with tempfile.TemporaryDirectory() as folder:
        run = interrupted(Path(folder))
        files = files_of(run.checkpoints()[-1])
        chosen = DAMAGES[: max(round(len(DAMAGES) * scale), 1)]
        missed = [
            f"{name} {damage.__name__}"
            for name in files
            for damage in chosen
            if not is_survived(run, name, damage)
        ]
    return {
        "files": files,
        "damages": [damage.__name__ for damage in chosen],
        "missed": missed,
        "claims": {"every damage is noticed and the checkpoint before is used": not missed},
    }


def job():
    """Return a job that keeps several checkpoints."""
    return tiny_job(
        algorithm=LITTLE_DQN,
        steps=1_000_000,
        evaluation={"everySteps": 0},
        checkpoint={"everySteps": CHECKPOINT_STEPS, "keep": 3},
    )


def interrupted(folder):
    """Train until several checkpoints exist, interrupt the run, and return it."""
    with LocalRun(folder, job()) as run:
        run.wait_for_step(STEPS)
    return run


def files_of(checkpoint):
    """Return the names of all files of a checkpoint, including files in subfolders."""
    return sorted(str(it.relative_to(checkpoint)) for it in checkpoint.rglob("*") if it.is_file())


def is_survived(run, name, damage):
    """Damage a file of the newest checkpoint, and return whether the run resumes from the older checkpoint.

    The files are restored afterwards.
    """
    kept = run.directory.with_name("kept")
    shutil.copytree(run.directory, kept)
    newest, before = run.checkpoints()[-1], run.checkpoints()[-2]
    attempts = len(run.attempts())
    damage(newest / name)
    with run:
        run.until(lambda: len(run.attempts()) > attempts)
        resumed = run.attempts()[-1] == f"resumed at step {before.name}"
        noticed = run.until(lambda: NOTICED in run.log() or not resumed)
    shutil.rmtree(run.directory)
    kept.rename(run.directory)
    return resumed and bool(noticed)
