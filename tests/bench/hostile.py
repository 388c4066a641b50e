"""The time until a job is planned while other tenants have jobs whose worlds are costly to check.

The operator is a separate process with the permissions of an installation. The control plane is real but has
no nodes. The measured memory includes the processes in which the operator checks worlds.
"""

import math
import tempfile
import threading
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.error import URLError

from palaestra.cluster import connect
from palaestra.cluster.resources import CONFIG_MAPS, JOBS, NAMESPACES, TRAINING_JOBS
from tests.bench.sizes import scaled
from tests.control_plane.plane import running
from tests.integration.operator.installed import operator, wait_for

ROOT = Path(__file__).parents[2]
HOSTILE, OTHERS = 32, 5
TENANTS = ("hostile-1", "hostile-2")  # two, because the operator runs two checks at the same time
MOST_BYTES = 899_900  # for all worlds of a job together; the operator refuses a job with more
MOST_BYTES_OF_ONE = 200_000  # for one inline world
LARGE_BYTES = 150_000  # large enough that the operator checks the world in a separate process
PERIOD_S = 0.1
DEADLINE_S = 600
HEADER = b"#VRML_SIM R2023b utf8\n"
ROBOT = b'Robot{controller "ros"}'
NODE = b"A{a 0}"  # no other node needs more memory per byte


def measure(scale=1.0):
    """Return the times to plan another tenant's jobs, without and with hostile jobs, and the memory."""
    count, others = scaled(HOSTILE, scale), scaled(OTHERS, scale)
    with tempfile.TemporaryDirectory(prefix="palaestra-hostile-") as name, running(Path(name)) as plane:
        api = _installed(plane)
        with operator(plane, plane.folder / "operator.log", in_a_pod=True) as running_operator:
            alone = {size: _seconds_to_plan(api, "alone", size, others) for size in (5_000, LARGE_BYTES)}
            idle_mib = _rss_mib(running_operator.process.pid)
            with _Watching(running_operator) as watched, ThreadPoolExecutor(8) as pool:
                began = time.monotonic()
                list(pool.map(lambda number: _create_hostile(api, number), range(count)))
                applied_s = time.monotonic() - began
                beside = {
                    size: _seconds_to_plan(api, "beside", size, others) for size in (5_000, LARGE_BYTES)
                }
                wait_for(lambda: _planned(api) == count, DEADLINE_S, lambda: _planned(api))
                all_s = time.monotonic() - began
        api.close()
    return {
        "hostile_jobs": count,
        "of_tenants": len(TENANTS),
        "bytes_of_each": MOST_BYTES,
        "seconds_to_plan_alone": alone,
        "seconds_to_plan_beside": beside,
        "hostile_applied_s": round(applied_s, 1),
        "hostile_planned_s": round(all_s, 1),
        "rss_mib_before": round(idle_mib),
        "rss_mib_at_most": round(watched.most_mib),
        "failed_probes": watched.failed,
    }


def costly(size, number=0):
    """Return a world of `size` bytes with the highest possible cost; worlds differ by `number`."""
    first = HEADER + b"# %d\n" % number + ROBOT
    return first + NODE * ((size - len(first)) // len(NODE))


def with_world(size, number=0):
    """Return the spec of a job whose costly worlds have `size` bytes together; no two worlds are equal."""
    groups = math.ceil(size / MOST_BYTES_OF_ONE)
    worlds = [costly(size // groups, 100 * number + place).decode() for place in range(groups)]
    return {
        "simulators": [
            {"name": f"g{place}", "role": "Collect", "world": {"inline": text}}
            for place, text in enumerate(worlds)
        ],
        "trainer": {"evaluation": {"everySteps": 0}},
    }


class _Watching:
    """Samples the operator's memory and its health probe during a `with` block."""

    def __init__(self, running_operator):
        self._operator = running_operator
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._sample)
        self.most_mib, self.failed = 0.0, 0

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()

    def _sample(self):
        while not self._ended.wait(PERIOD_S):
            self.most_mib = max(self.most_mib, _rss_mib(self._operator.process.pid))
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{self._operator.port}/healthz", timeout=1).close()
            except (URLError, TimeoutError):
                self.failed += 1


def _rss_mib(pid):
    """Return the resident memory, in MiB, of a process and its children."""
    children = [each for path in Path(f"/proc/{pid}/task").glob("*/children") for each in _read(path).split()]
    lines = [line for each in (pid, *children) for line in _read(Path(f"/proc/{each}/status")).splitlines()]
    return sum(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024


def _read(path):
    """Return the text of a file in /proc, or "" if its process has ended."""
    try:
        return path.read_text()
    except OSError:
        return ""


def _seconds_to_plan(api, namespace, size, times):
    """Return the longest of several times, in seconds, from a job's creation to its batch/v1 Job."""
    longest = 0.0
    for number in range(times):
        name = f"job-{size}-{number}"
        began = time.monotonic()
        _create(api, namespace, name, with_world(size, number))
        wait_for(lambda name=name: f"{name}-0" in _names(api, namespace), DEADLINE_S, lambda name=name: name)
        longest = max(longest, time.monotonic() - began)
    return round(longest, 1)


def _installed(plane):
    """Install Palaestra, create the namespaces of tenants, and return an administrator's client."""
    done = plane.kubectl("apply", "--server-side", "-f", str(ROOT / "manifests" / "install.yaml"))
    assert done.returncode == 0, done.stderr
    plane.await_kinds("crd/trainingjobs.palaestra.dev")
    api = connect(str(plane.kubeconfig)).within(60)
    wait_for(lambda: api.serves("palaestra.dev/v1alpha1"), 30, api.version)
    for name in ("alone", "beside", *TENANTS):
        api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": name}})
    return api


def _create_hostile(api, number):
    """Create a job with worlds of the largest size; every second job reads one world from a ConfigMap."""
    name, namespace = f"job-{number}", TENANTS[number // 2 % len(TENANTS)]
    if number % 2:
        return _create(api, namespace, name, with_world(MOST_BYTES, number))
    metadata = {"name": name, "namespace": namespace, "labels": {"palaestra.dev/for-jobs": "true"}}
    data = {"my.wbt": costly(MOST_BYTES, 100 * number).decode()}
    head = {"apiVersion": "v1", "kind": "ConfigMap", "metadata": metadata}
    api.create(CONFIG_MAPS, head | {"data": data})
    spec = with_world(0)
    spec["simulators"] = [
        {"name": "g0", "role": "Collect", "world": {"configMap": {"name": name, "key": "my.wbt"}}}
    ]
    return _create(api, namespace, name, spec)


def _create(api, namespace, name, spec):
    metadata = {"name": name, "namespace": namespace}
    head = {"apiVersion": "palaestra.dev/v1alpha1", "kind": "TrainingJob", "metadata": metadata}
    return api.create(TRAINING_JOBS, head | {"spec": spec})


def _planned(api):
    """Return the number of hostile jobs for which a batch/v1 Job exists."""
    return sum(len(_names(api, namespace)) for namespace in TENANTS)


def _names(api, namespace):
    return {job["metadata"]["name"] for job in api.list(JOBS.only_metadata(), namespace)}
