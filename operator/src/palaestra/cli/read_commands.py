"""`palaestra get`, `describe`, `events` and `logs`."""

import argparse
import json
import sys
from datetime import UTC, datetime

from palaestra.api import validate
from palaestra.cli.cluster import cluster_command, say
from palaestra.cli.subcommands import Commands
from palaestra.client import Client, asked, check_namespace
from palaestra.cluster.resources import TRAINING_JOBS
from palaestra.errors import PalaestraError
from palaestra.plan.yaml_text import as_yaml
from palaestra.view import describe, happened, server_table, without_status
from palaestra_protocol.numbers import seconds, whole

READS = "Reads the cluster and changes nothing.\n"
GET = f"""\
Lists TrainingJobs, or shows one. {READS}"""
DESCRIBE = f"""\
Shows a TrainingJob in full: spec, conditions, each replica's progress, simulators, faults and last attempt,
and events. {READS}"""
EVENTS = f"""\
Lists the events about a TrainingJob and its Jobs, pods and claims, oldest first. Kubernetes deletes events
after an hour by default. {READS}"""
LOGS = f"""\
Prints the log of a container of a replica's newest pod. {READS}"""
LOG_S = 86_400.0
UNSEEN = "no operator has reconciled it; check that the operator runs and watches this namespace"


def add(commands: Commands) -> None:
    """Add the four commands."""
    _add_get(commands)
    for name, work, description in (
        ("describe", _describe, DESCRIBE),
        ("events", _events, EVENTS),
    ):
        parser = cluster_command(commands, name, work, description)
        parser.add_argument("name", metavar="NAME", help="name of the job")
    _add_logs(commands)


def _add_get(commands: Commands) -> None:
    parser = cluster_command(commands, "get", _get, GET)
    parser.add_argument("name", metavar="NAME", nargs="?", help="name of one job; default: all jobs")
    parser.add_argument("-A", "--all-namespaces", action="store_true", help="jobs of all namespaces")
    parser.add_argument("-l", "--selector", metavar="LABELS", help="jobs with these labels: key=value,...")
    parser.add_argument(
        "-o", "--output", choices=("wide", "json", "yaml", "name"), help="format; default: a table"
    )


def _add_logs(commands: Commands) -> None:
    parser = cluster_command(commands, "logs", _logs, LOGS)
    parser.add_argument("name", metavar="NAME", help="name of the job")
    parser.add_argument("--replica", metavar="N", type=whole(), default=0, help="number; default: 0")
    parser.add_argument(
        "-c",
        "--container",
        metavar="NAME",
        default="trainer",
        help="trainer, ros-master or sim-<group>-<number>; default: trainer",
    )
    parser.add_argument("-f", "--follow", action="store_true", help="keep printing until the container ends")
    parser.add_argument("--tail", metavar="N", type=whole(), help="the last N lines only")
    parser.add_argument(
        "--timeout", metavar="S", type=seconds, default=LOG_S, help="seconds to follow; default: a day"
    )


def _get(client: Client, options: argparse.Namespace) -> int:
    if options.name and (options.all_namespaces or options.selector):
        raise PalaestraError("NAME: cannot be combined with -A or -l; remove NAME or the options")
    show = _table if options.output in {None, "wide"} else _document
    return show(client, options, None if options.all_namespaces else client.namespace)


def _table(client: Client, options: argparse.Namespace, namespace: str | None) -> int:
    """Print the table of `kubectl get`; if the table is empty, print a sentence on standard error."""
    with asked(options.name, client.namespace):
        table = client.api.table(TRAINING_JOBS, namespace, options.name, labels=options.selector)
    if options.name is None and not table.get("rows"):
        if namespace is not None:
            check_namespace(client.api, namespace)
        where = "the cluster" if namespace is None else f"namespace {namespace}"
        chosen = f" with labels {options.selector}" if options.selector else ""
        sys.stderr.write(f"no TrainingJobs{chosen} in {where}\n")
        return 0
    say(server_table(table, wide=options.output == "wide", namespaces=options.all_namespaces))
    if unseen := without_status(table):
        sys.stderr.write(f"{', '.join(unseen)}: {UNSEEN}\n")
    return 0


def _document(client: Client, options: argparse.Namespace, namespace: str | None) -> int:
    """Print the jobs for programs, in the form that the API server stores."""
    if options.name:
        found = [client.raw(options.name)]
    else:
        with asked(None, client.namespace):
            found = client.api.list(TRAINING_JOBS, namespace, labels=options.selector)
        if namespace is not None and not found:
            check_namespace(client.api, namespace)
    if options.output == "name":
        say(f"trainingjob.palaestra.dev/{job['metadata']['name']}" for job in found)
    elif options.output == "yaml":
        say([as_yaml(found).rstrip("\n")])
    else:
        whole = found[0] if options.name else {"apiVersion": "v1", "kind": "List", "items": found}
        say([json.dumps(whole, indent=2, ensure_ascii=False)])
    return 0


def _describe(client: Client, options: argparse.Namespace) -> int:
    found, now = client.raw(options.name), datetime.now(UTC)
    created = datetime.fromisoformat(found["metadata"]["creationTimestamp"])
    say(describe(validate(found, options.name), created, now))
    say(["", "Events:", *(f"  {line}" for line in happened(client.events(options.name), now))])
    return 0


def _events(client: Client, options: argparse.Namespace) -> int:
    say(happened(client.events(options.name), datetime.now(UTC)))
    return 0


def _logs(client: Client, options: argparse.Namespace) -> int:
    say(
        client.logs(
            options.name,
            replica=options.replica,
            container=options.container,
            follow=options.follow,
            tail=options.tail,
            deadline_s=options.timeout,
        )
    )
    return 0
