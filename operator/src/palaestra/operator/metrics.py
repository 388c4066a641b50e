"""What the operator counts about itself and its jobs.

Labels are bounded: no job's name, which would outlive the job. What a training does is told by its
own pods.
"""

from collections import Counter as Tally
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import version

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.metrics_core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from palaestra.api.status import Phase

SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


class Metrics:
    """The operator's metrics, in a registry of their own."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self.reconciled = Histogram(
            "palaestra_operator_reconcile_duration_seconds",
            "Time that one look at a TrainingJob took, by its end: done, conflict or error",
            ["result"],
            buckets=SECONDS,
            registry=self.registry,
        )
        self._requests = Counter(
            "palaestra_operator_requests_total",
            "Requests to the API server; code 0: no answer",
            ["verb", "resource", "code"],
            registry=self.registry,
        )
        self._request_seconds = Histogram(
            "palaestra_operator_request_duration_seconds",
            "Time that a request to the API server took, watches aside",
            ["verb"],
            buckets=SECONDS,
            registry=self.registry,
        )
        self._queued = Histogram(
            "palaestra_operator_queue_wait_seconds",
            "Time that a TrainingJob waited for a worker",
            buckets=SECONDS,
            registry=self.registry,
        )
        self._depth = Gauge(
            "palaestra_operator_queue_depth", "TrainingJobs that wait for a worker", registry=self.registry
        )
        self._leader = Gauge(
            "palaestra_operator_leader", "1 while this operator leads", registry=self.registry
        )
        build = Gauge("palaestra_operator_build_info", "1; its release", ["version"], registry=self.registry)
        build.labels(version("palaestra")).set(1)

    def request(self, verb: str, resource: str, code: int, seconds: float) -> None:
        """Count a request; `code` is 0 when no answer came, `seconds` until the answer's head."""
        self._requests.labels(verb, resource, str(code)).inc()
        if verb != "watch":
            self._request_seconds.labels(verb).observe(seconds)

    def waited(self, seconds: float) -> None:
        """Count how long a key waited in the queue."""
        self._queued.observe(seconds)

    def watch(
        self, *, depth: Callable[[], int], leads: Callable[[], bool], phases: Callable[[], Iterable[str]]
    ) -> None:
        """Tell the queue's depth, leadership and the jobs' phases as they are when asked."""
        self._depth.set_function(depth)
        self._leader.set_function(lambda: float(leads()))
        self.registry.register(_Jobs(phases))

    def text(self) -> bytes:
        """Return all of them as Prometheus reads them."""
        return generate_latest(self.registry)


class _Jobs(Collector):
    """Counts the jobs by phase when asked, so that no gauge can be left behind by a deleted job."""

    def __init__(self, phases: Callable[[], Iterable[str]]) -> None:
        self._phases = phases

    def collect(self) -> Iterator[Metric]:
        """Yield one gauge with a value for each phase."""
        tally = Tally(self._phases())
        family = GaugeMetricFamily("palaestra_jobs", "TrainingJobs by phase", labels=["phase"])
        for phase in Phase:
            family.add_metric([phase.value], tally[phase.value])
        yield family
