"""`palaestra doctor`: what keeps jobs from running in a cluster."""

import argparse
from collections.abc import Iterator

from palaestra.cli.cluster import REFUSED, cluster_command, say
from palaestra.cli.parsing import Commands
from palaestra.client import Client
from palaestra.doctor import Finding, Site, Verdict, examine
from palaestra.operator.options import DEFAULT_NAMESPACE

DOCTOR = """\
Looks at a cluster: version, sidecars, the definition of TrainingJobs, the namespace, storage, the operator,
its images, its leader, its rights and its metrics, and your own rights. Says what is wrong and the remedy.
Reads the cluster; writes nothing but its output, since what has to be tried is a dry run. Ends with 1 if
anything is wrong; a warning does not count, nor does what could not be seen.
"""
WIDTH = 18


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "doctor", _doctor, "tell what keeps jobs from running", DOCTOR)
    parser.add_argument(
        "--operator-namespace",
        metavar="NS",
        default=DEFAULT_NAMESPACE,
        help=f"where the operator is; default: {DEFAULT_NAMESPACE}",
    )


def _doctor(client: Client, options: argparse.Namespace) -> int:
    site = Site(api=client.api, namespace=client.namespace, operator_namespace=options.operator_namespace)
    found = []
    for each in examine(site):
        found.append(each)
        say(shown(each))
    return REFUSED if any(each.verdict is Verdict.WRONG for each in found) else 0


def shown(found: Finding) -> Iterator[str]:
    """Yield a line for a finding, and one for its remedy."""
    yield f"{found.verdict:<8} {found.what:<{WIDTH}} {found.fact}"
    if found.remedy:
        yield f"{'':<8} {'':<{WIDTH}} -> {found.remedy}"
