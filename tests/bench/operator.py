"""The costs of the operator: time and processor for many jobs, requests for one job, memory, idle requests.

The control plane has no nodes, so only the API server, the Job controller and the operator run. For
comparison, a client creates the same objects in the same control plane.
"""

import os
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

from palaestra.cluster import connect
from palaestra.cluster.resources import NAMESPACES, PODS
from tests.bench import crowd, operator_memory, single
from tests.bench.sizes import scaled
from tests.control_plane.plane import running
from tests.integration.operator.installed import asked, operator

ROOT = Path(__file__).parents[2]
JOBS = 1000
FAST = 500  # requests per second of each controller; the default of Kubernetes is 20
QUIET_S = 30
TICKS_A_SECOND = os.sysconf("SC_CLK_TCK")


def measure(scale=1.0):
    """Return the figures of many jobs, of one job, and of memory.

    Many jobs are measured at both request rates of the Job controller.
    """
    return {
        "jobs": scaled(JOBS, scale),
        "default_rate": measure_crowd(None, scale),
        "fast": measure_crowd(FAST, scale),
        "one_job": measure_one_job(),
        "memory": operator_memory.measure(scale),
    }


def measure_crowd(requests_per_s, scale):
    """Return the figures of many jobs; they run in a separate control plane."""
    with cluster(requests_per_s) as (plane, api, folder):
        return figures_of_a_crowd(plane, api, folder, scaled(JOBS, scale), QUIET_S)


def figures_of_a_crowd(plane, api, folder, count, quiet_s):
    """Return the seconds until `count` pods exist, and the operator's cost.

    The seconds are measured three times: for Jobs alone, for a client that creates all objects, and for the
    operator.
    """
    bare_s = seconds_to_pods(api, "bare", crowd.create_bare_jobs, count)
    client_s = seconds_to_pods(api, "client", crowd.create_all_objects, count)
    with operator(plane, folder / "operator.log") as running_operator:
        spent = cpu_seconds(running_operator.process.pid)
        operator_s = seconds_to_pods(api, "operator", crowd.create_training_jobs, count)
        crowd.wait_for_silence(plane)
        spent = cpu_seconds(running_operator.process.pid) - spent
        before = requests(plane)
        time.sleep(quiet_s)  # idle time, in which no request may arrive
        return {
            "bare_jobs_s": round(bare_s, 1),
            "client_s": round(client_s, 1),
            "operator_s": round(operator_s, 1),
            "times_client": round(operator_s / client_s, 2),
            "times_bare_jobs": round(operator_s / bare_s, 2),
            "cpu_ms_a_job": round(1000 * spent / count, 1),
            "rss_mib": mib(running_operator.rss_bytes()),
            "requests_in_silence": requests(plane) - before,
        }


def measure_one_job():
    """Return the requests to the API server for one job, from its creation to its end.

    The job trains for ten seconds.
    """
    with cluster(None) as (plane, api, folder), operator(plane, folder / "operator.log"):
        crowd.wait_for_silence(plane)
        return single.requests_of_one_job(plane, api)


@contextmanager
def cluster(requests_per_s):
    """Run a control plane with Palaestra; yield the plane, an administrator's client and a folder."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "plane").mkdir()
        with running(folder / "plane", requests_per_s=requests_per_s) as plane:
            done = plane.kubectl("apply", "-f", str(ROOT / "manifests" / "install.yaml"))
            if done.returncode:
                raise RuntimeError(done.stderr)
            plane.await_kinds("crd/trainingjobs.palaestra.dev")
            api = connect(str(plane.kubeconfig))
            yield plane, api.within(60), folder
            api.close()


def seconds_to_pods(api, namespace, create, count):
    """Return the seconds from the first object that `create` creates, in a new namespace, to the last pod."""
    api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": namespace}})
    crowd.wait_for_account(api, namespace)
    began = time.monotonic()
    create(api, namespace, count)
    crowd.wait_for_count(api, PODS, namespace, count)
    return time.monotonic() - began


def cpu_seconds(pid):
    """Return the processor time that a process has used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_A_SECOND


def requests(plane):
    """Return the number of requests of all operators, except watches and requests for the Lease."""
    return sum(each.counts for each in asked(plane))


def mib(count):
    """Return bytes as MiB."""
    return round(count / 1024**2, 1)
