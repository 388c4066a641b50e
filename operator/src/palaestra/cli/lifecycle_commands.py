"""`palaestra suspend`, `resume`, `restart` and `delete`."""

import argparse

from palaestra.api import TrainingJob
from palaestra.api.storage import Retain
from palaestra.cli.cluster import cluster_command, say
from palaestra.cli.subcommands import Commands
from palaestra.client import Client
from palaestra_protocol.numbers import seconds

SUSPEND = """\
Sets spec.suspend of TrainingJobs to true: the pods save a checkpoint and are deleted. Refuses a job with a
queue, because Kueue suspends and resumes it, and a job that has ended.
"""
RESUME = """\
Sets spec.suspend of TrainingJobs to false: they resume from their checkpoints. Refuses a job with a queue,
because Kueue suspends and resumes it, and a job that has ended.
"""
RESTART = """\
Lets replicas with the reason RunLost continue. A replica whose claim is gone gets a new one and trains from
step 0 again. A replica whose run directory was empty resumes from the newest checkpoint that the directory
has now; without a checkpoint, it begins at step 0 too.
"""
DELETE = """\
Deletes TrainingJobs with their pods and waits until they are deleted. The claims with their runs stay unless
the job has `retain: Delete`; the command prints how to delete them.
"""
GONE_S = 300.0


def add(commands: Commands) -> None:
    """Add the four commands."""
    for name, work, description in (
        ("suspend", _suspend, SUSPEND),
        ("resume", _resume, RESUME),
        ("restart", _restart, RESTART),
        ("delete", _delete, DELETE),
    ):
        parser = cluster_command(commands, name, work, description)
        parser.add_argument("names", metavar="NAME", nargs="+", help="names of the jobs")
    parser.add_argument(
        "--timeout",
        metavar="S",
        type=seconds,
        default=GONE_S,
        help="seconds to wait for each job; default: 300",
    )


def _suspend(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        client.suspend(name)
        say([f"{name}: will be suspended after a checkpoint; `palaestra watch {name}` shows its progress"])
    return 0


def _resume(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        client.resume(name)
        say([f"{name}: will resume; `palaestra watch {name}` shows its progress"])
    return 0


def _restart(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        client.restart(name)
        say([f"{name}: will begin its lost runs again; `palaestra watch {name}` shows its progress"])
    return 0


def _delete(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        job = client.get(name)
        client.delete(name, deadline_s=options.timeout)
        say([f"{name}: deleted{_left(job)}"])
    return 0


def _left(job: TrainingJob) -> str:
    """Return the command that deletes the remaining claims; empty if no claim remains."""
    storage = job.spec.storage
    if storage.ephemeral or storage.existing_claim or storage.retain is Retain.DELETE:
        return ""
    chosen = f"-n {job.metadata.namespace} -l palaestra.dev/job-uid={job.metadata.uid}"
    return f"; its runs stay, `kubectl delete pvc {chosen}` deletes them"
