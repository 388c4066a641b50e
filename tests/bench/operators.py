"""The operator next to Jobs alone, JobSet and Kubeflow Trainer, each in its own control plane without nodes.

The pods have the same size, whichever kind of object creates them. A client creates the objects; the figures
come from the audit log, from /proc and from the API server's metrics.
"""

import os
import re
import time
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from palaestra.cluster.resources import NAMESPACES, PODS
from tests.bench import crowd
from tests.bench.foreign_operators import (
    JOB_SET,
    TRAINER,
    create_job_sets,
    create_train_jobs,
    programs,
    running_foreign,
)
from tests.bench.operator import FAST, cluster, cpu_seconds
from tests.bench.operator_memory import memory
from tests.bench.sizes import scaled
from tests.integration.operator.installed import READS, USER, operator
from tests.waiting import eventually

JOBS = 1000
MANY = 10_000
NAMESPACE = "crowd"
SILENCE_S, DEADLINE_S = 10, 1200
WEBHOOK_CALLS = r"^apiserver_admission_webhook_request_total\{.*\} (\S+)$"
# Prefixes of the names of the users as which each program sends its requests.
USERS = {
    "palaestra": (USER,),
    JOB_SET.program: (JOB_SET.user,),
    TRAINER.program: (TRAINER.user,),
    "kube-controller-manager": ("system:kube-controller-manager", "system:serviceaccount:kube-system:"),
}
EVERYONE = sum(USERS.values(), ())


def measure(scale=1.0):
    """Return the figures of each kind: time, requests, processor time and memory until all pods exist."""
    count = scaled(JOBS, scale)
    programs(build=True)
    return {"jobs": count} | {
        name: _figures(create, started, count)
        for name, create, started in (
            ("jobs_alone", crowd.create_bare_jobs, _no_operator),
            ("training_jobs", crowd.create_training_jobs, _our_operator),
            ("job_sets", create_job_sets, lambda plane: running_foreign(plane, (JOB_SET,))),
            ("train_jobs", create_train_jobs, lambda plane: running_foreign(plane, (JOB_SET, TRAINER))),
        )
    }


def measure_many(scale=1.0):
    """Return the figures of ten times as many TrainingJobs."""
    count = scaled(MANY, scale)
    return {"jobs": count} | _figures(crowd.create_training_jobs, _our_operator, count)


@contextmanager
def _no_operator(_plane):
    yield {}


@contextmanager
def _our_operator(plane):
    with operator(plane, plane.folder / "operator.log", in_a_pod=True) as running:
        yield {"palaestra": running.process.pid}


def _figures(create, started, count):
    """Return the figures of one kind, whose objects `create` creates.

    `started` starts the operators of the kind.
    """
    with cluster(FAST) as (plane, api, _folder), started(plane) as operators:
        names = ("kube-controller-manager", "kube-apiserver", "etcd")
        pids = operators | {name: _pid(plane, name) for name in names}
        api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": NAMESPACE}})
        crowd.wait_for_account(api, NAMESPACE)
        _wait_for_silence(plane)
        before, calls = len(plane.audit()), _webhook_calls(plane)
        spent = {name: cpu_seconds(pid) for name, pid in pids.items()}
        create(api, NAMESPACE, count)
        crowd.wait_for_count(api, PODS, NAMESPACE, count)
        _wait_for_silence(plane)
        log = plane.audit()[before:]
        return _seconds(log) | {
            "webhook_calls_a_job": round((_webhook_calls(plane) - calls) / count, 1),
            "load": round(os.getloadavg()[0], 1),
            "programs": {
                name: {
                    "cpu_ms_a_job": round(1000 * (cpu_seconds(pid) - spent[name]) / count, 1),
                    "peak_rss_mib": memory(pid)["peak_mib"],
                }
                | (_requests(log, USERS[name], count) if name in USERS else {})
                for name, pid in pids.items()
            },
        }


def _seconds(log):
    """Return the seconds from the client's first request to the last Job, and to the last pod."""
    began = min(each["requestReceivedTimestamp"] for each in log if _creates(each))
    created = {
        resource: [each["stageTimestamp"] for each in log if _creates(each, resource)]
        for resource in ("jobs", "pods")
    }
    return {
        f"seconds_to_the_last_{resource[:-1]}": round(_between(began, max(times)), 1)
        for resource, times in created.items()
    }


def _creates(entry, resource=None):
    """Return whether a logged request created an object of the crowd; `resource` limits the kind."""
    what = entry.get("objectRef") or {}
    return (
        entry["stage"] == "ResponseComplete"
        and entry["responseStatus"]["code"] == 201
        and what.get("namespace") == NAMESPACE
        and resource in {None, what["resource"]}
    )


def _between(began, ended):
    return (datetime.fromisoformat(ended) - datetime.fromisoformat(began)).total_seconds()


def _requests(log, users, count):
    """Return the users' reads, writes and events for each job; watches and Leases do not count."""
    found = [each for each in log if _counts(each, users)]
    events = sum(each["objectRef"]["resource"] == "events" for each in found)
    reads = sum(each["verb"] in READS for each in found)
    return {
        "reads_a_job": round(reads / count, 2),
        "writes_a_job": round((len(found) - reads - events) / count, 2),
        "events_a_job": round(events / count, 2),
    }


def _counts(entry, users):
    """Return whether an entry of the log is a request of these users that counts."""
    return (
        entry["stage"] == "ResponseComplete"
        and entry["user"].get("username", "").startswith(users)
        and entry["verb"] != "watch"
        and entry.get("objectRef", {}).get("resource", "leases") != "leases"
    )


def _wait_for_silence(plane):
    """Wait until, for ten seconds, no operator and no controller has sent a request that counts."""

    def counted():
        return sum(_counts(each, EVERYONE) for each in plane.audit())

    def silent():
        before = counted()
        time.sleep(SILENCE_S)  # the period in which no request may arrive
        return counted() == before

    eventually(silent, DEADLINE_S)


def _webhook_calls(plane):
    """Return the number of calls of all webhooks so far."""
    metrics = plane.kubectl("get", "--raw", "/metrics").stdout
    return sum(float(number) for number in re.findall(WEBHOOK_CALLS, metrics, re.MULTILINE))


def _pid(plane, program):
    """Return the process ID of a program of this control plane."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # a process may end at any time
            words = path.read_text().split("\0")
            if words[0] == str(plane.binaries / program) and str(plane.folder) in " ".join(words):
                return int(path.parent.name)
    raise LookupError(program)
