"""`palaestra doctor`: find the reasons for which jobs do not run in a cluster."""

import argparse
from collections.abc import Iterator

from palaestra.cli.cluster import REFUSED, cluster_command, say
from palaestra.cli.subcommands import Commands
from palaestra.client import Client
from palaestra.doctor import CheckResult, CheckStatus, Site, examine
from palaestra.operator.options import DEFAULT_NAMESPACE

DOCTOR = """\
Checks a cluster: version, sidecars, the definition of TrainingJobs, the namespace, storage, the operator, its
images, its leader, its rights and its metrics, and your own rights. Prints each problem with its remedy.
Changes nothing in the cluster: it only reads objects, and creates a pod in a dry run. Exits with 1 if a check
finds a problem; warnings and checks that could not be made do not count.
"""
WIDTH = 18


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "doctor", _doctor, DOCTOR)
    parser.add_argument(
        "--operator-namespace",
        metavar="NS",
        default=DEFAULT_NAMESPACE,
        help=f"namespace of the operator; default: {DEFAULT_NAMESPACE}",
    )


def _doctor(client: Client, options: argparse.Namespace) -> int:
    site = Site(api=client.api, namespace=client.namespace, operator_namespace=options.operator_namespace)
    found = []
    for finding in examine(site):
        found.append(finding)
        say(shown(finding))
    return REFUSED if any(finding.verdict is CheckStatus.WRONG for finding in found) else 0


def shown(found: CheckResult) -> Iterator[str]:
    """Yield a line with a finding, and another line with its remedy."""
    yield f"{found.verdict:<8} {found.what:<{WIDTH}} {found.fact}"
    if found.remedy:
        yield f"{'':<8} {'':<{WIDTH}} -> {found.remedy}"
