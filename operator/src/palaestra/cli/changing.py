"""`palaestra suspend`, `resume` and `delete`: the few things of a job that may change."""

import argparse

from palaestra.api import TrainingJob
from palaestra.api.storage import Retain
from palaestra.cli.cluster import cluster_command, say
from palaestra.cli.parsing import Commands
from palaestra.client import Client
from palaestra_sim.typed import seconds

SUSPEND = """\
Sets spec.suspend of TrainingJobs: their pods are deleted after a checkpoint. A job with a queue is refused,
since its queue decides.
"""
RESUME = """\
Takes spec.suspend of TrainingJobs back: they go on from their checkpoints. A job with a queue is refused,
since its queue decides.
"""
DELETE = """\
Deletes TrainingJobs with their pods, and waits until they are gone. The claims with their runs stay unless
the job says `retain: Delete`; the command that removes them is printed.
"""
GONE_S = 300.0


def add(commands: Commands) -> None:
    """Add the three commands."""
    for name, work, summary, description in (
        ("suspend", _suspend, "let jobs rest", SUSPEND),
        ("resume", _resume, "let suspended jobs go on", RESUME),
        ("delete", _delete, "delete jobs", DELETE),
    ):
        parser = cluster_command(commands, name, work, summary, description)
        parser.add_argument("names", metavar="NAME", nargs="+", help="of the jobs")
    parser.add_argument(
        "--timeout", metavar="S", type=seconds, default=GONE_S, help="seconds to wait for each; default: 300"
    )


def _suspend(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        client.suspend(name)
        say([f"{name}: to be suspended after a checkpoint; `palaestra watch {name}` shows when it is"])
    return 0


def _resume(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        client.resume(name)
        say([f"{name}: to go on; `palaestra watch {name}` shows when it does"])
    return 0


def _delete(client: Client, options: argparse.Namespace) -> int:
    for name in options.names:
        job = client.get(name)
        client.delete(name, deadline_s=options.timeout)
        say([f"{name}: deleted{_left(job)}"])
    return 0


def _left(job: TrainingJob) -> str:
    """Return what is said of the runs that stay."""
    storage = job.spec.storage
    if storage.ephemeral or storage.existing_claim or storage.retain is Retain.DELETE:
        return ""
    chosen = f"-n {job.metadata.namespace} -l palaestra.dev/job-uid={job.metadata.uid}"
    return f"; its runs stay, `kubectl delete pvc {chosen}` removes them"
