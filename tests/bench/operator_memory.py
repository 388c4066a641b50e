"""The operator's memory when idle, with large jobs, and with many jobs.

The operator is a separate process with the permissions of an installation and the environment of its image.
The control plane is real but has no nodes, so all pods stay Pending.
"""

import re
import tempfile
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import yaml

from palaestra.cluster import connect
from palaestra.cluster.resources import JOBS, NAMESPACES, TRAINING_JOBS
from tests.bench.sizes import scaled
from tests.control_plane.plane import running
from tests.integration.operator.installed import asked, operator, wait_for

ROOT = Path(__file__).parents[2]
NAMESPACE = "crowd"
LARGE, PLANNED, FINISHED = 400, 1_000, 10_000
GROUPS, CHARACTERS = 5, 180_000  # 900,000 characters in total, the most that an API server accepts
SETTLED_S, SETTLES_S = 5, 1200
MIB = 1 << 20
THEN = "2026-01-01T00:00:00Z"


def measure(scale=1.0):
    """Return resident memory in MiB: `rss` is the current value, and `peak` the maximum so far."""
    refused, planned_jobs, ended = (scaled(count, scale) for count in (LARGE, PLANNED, FINISHED))
    with crowd("large") as (plane, api):
        idle = started(plane)
        create(api, (large_job(number) for number in range(refused)))
        large = {"first": started(plane), "again": started(plane)}
    with crowd("planned") as (plane, api):
        planned = beside_planned(plane, api, planned_jobs)
    with crowd("finished") as (plane, api):
        create_finished(api, ended)
        finished = started(plane)
    return {
        "idle": idle,
        f"beside_{refused}_refused_jobs_of_{GROUPS * CHARACTERS}_characters": large,
        f"beside_{planned_jobs}_jobs": planned,
        f"beside_{ended}_finished_jobs": finished,
    }


@contextmanager
def crowd(name):
    """Run a control plane with Palaestra and a namespace for many jobs; yield the plane and a client."""
    with tempfile.TemporaryDirectory(prefix=f"palaestra-{name}-") as folder, running(Path(folder)) as plane:
        done = plane.kubectl("apply", "--server-side", "-f", str(ROOT / "manifests" / "install.yaml"))
        assert done.returncode == 0, done.stderr
        plane.await_kinds("crd/trainingjobs.palaestra.dev")
        api = connect(str(plane.kubeconfig)).within(60)
        wait_for(lambda: api.serves("palaestra.dev/v1alpha1"), 30, api.version)
        api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": NAMESPACE}})
        yield plane, api
        api.close()


def started(plane):
    """Start an operator, and return its memory after it has processed all existing objects."""
    began = time.monotonic()
    with operator(plane, plane.folder / "operator.log", in_a_pod=True) as running_operator:
        settle(plane, running_operator)
        found = memory(running_operator.process.pid) | {"seconds": round(time.monotonic() - began)}
        running_operator.end()  # releases the Lease, so that the next operator leads at once
    return found


def beside_planned(plane, api, count):
    """Return the memory of two operators.

    The first one planned the jobs when they were created; the second one started later.
    """
    with operator(plane, plane.folder / "operator.log", in_a_pod=True) as running_operator:
        create(api, (small_job(number) for number in range(count)))
        wait_for(lambda: jobs(api) == count, SETTLES_S, lambda: jobs(api))
        settle(plane, running_operator)
        first = memory(running_operator.process.pid)
        running_operator.end()
    return {"saw_them_come": first, "started_later": started(plane)}


def jobs(api):
    """Return the number of batch/v1 Jobs."""
    return len(api.list(JOBS.only_metadata(), NAMESPACE))


def settle(plane, running_operator):
    """Wait until an operator leads and, for some seconds, has sent only watches and Lease requests."""

    def leads():
        with urllib.request.urlopen(
            f"http://127.0.0.1:{running_operator.port}/metrics", timeout=10
        ) as answer:
            return b"palaestra_operator_leader 1.0" in answer.read()

    def quiet():
        before = sum(each.counts for each in asked(plane))
        time.sleep(SETTLED_S)  # a period in which no request may arrive
        return sum(each.counts for each in asked(plane)) == before

    wait_for(leads, SETTLES_S, lambda: asked(plane)[-5:])
    wait_for(quiet, SETTLES_S, lambda: asked(plane)[-5:])


def memory(pid):
    """Return the current and the largest resident memory of a process, in MiB."""
    text = Path(f"/proc/{pid}/status").read_text()
    found = {name: int(kib) / 1024 for name, kib in re.findall(r"(VmRSS|VmHWM):\s+(\d+) kB", text)}
    return {"rss_mib": round(found["VmRSS"], 1), "peak_mib": round(found["VmHWM"], 1)}


def create(api, made):
    """Create TrainingJobs, several at a time."""
    with ThreadPoolExecutor(4) as pool:
        return list(pool.map(lambda job: api.create(TRAINING_JOBS, job), made))


def create_finished(api, count):
    """Create TrainingJobs whose status reports success before any operator runs."""
    status = {"status": finished_status()}

    def end(job):
        api.merge(TRAINING_JOBS, NAMESPACE, job["metadata"]["name"], status, subresource="status")

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(end, create(api, (small_job(number) for number in range(count)))))


def small_job(number):
    """Return the smallest TrainingJob."""
    job = yaml.safe_load((ROOT / "manifests" / "examples" / "minimal.yaml").read_text())
    return job | {"metadata": {"name": f"job-{number:05d}", "namespace": NAMESPACE}}


def large_job(number):
    """Return a TrainingJob with inline worlds of the largest size that an API server accepts.

    All worlds are invalid.
    """
    groups = [
        {
            "name": f"g{place}",
            "role": "Collect",
            "world": {"inline": f"{number} {place}".ljust(CHARACTERS, "x")},
        }
        for place in range(GROUPS)
    ]
    return small_job(number) | {"spec": {"simulators": groups, "trainer": {"evaluation": {"everySteps": 0}}}}


def finished_status():
    """Return the status of a job whose only replica has succeeded."""
    told = {"reason": "Succeeded", "message": "the trainer has finished"}
    conditions = [
        {"type": kind, "status": "True", "lastTransitionTime": THEN, "observedGeneration": 1, **told}
        for kind in ("Accepted", "Succeeded")
    ]
    images = {
        name: f"registry.example.com/robots/palaestra-{name}:0.1.0"
        for name in ("trainer", "stub", "mujoco", "webots")
    }
    log = [f"2026-01-01T00:00:{line:02d}Z line {line} of what the trainer wrote last" for line in range(10)]
    replica = {
        "index": 0,
        "phase": "Succeeded",
        **told,
        "since": THEN,
        "attempt": 1,
        "pod": {"name": "job-0-abcde", "uid": "01234567-89ab-cdef-0123-456789abcdef", "created": THEN},
        "step": 50_000,
        "target": 50_000,
        "successRate": 0.95,
        "meanReturn": 12.5,
        "restarts": {"trainer": 0, "simulator": 1, "disruption": 0, "suspension": 0},
        "lastAttempt": {"attempt": 1, "pod": "job-0-abcde", "ended": THEN, **told, "log": log},
    }
    return {
        "observedGeneration": 1,
        "phase": "Succeeded",
        "release": images,
        "conditions": conditions,
        "startTime": THEN,
        "completionTime": THEN,
        "activeSeconds": 600,
        "running": "1/1",
        "step": 50_000,
        "successRate": 0.95,
        "replicas": [replica],
    }
