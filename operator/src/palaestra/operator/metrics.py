"""The operator's metrics about itself and its jobs, with the names of `metric_definitions`."""

from collections import Counter as Count
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime
from importlib.metadata import version
from typing import TypeVar

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Histogram,
    ProcessCollector,
    disable_created_metrics,
    generate_latest,
)
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from palaestra.api.reasons import Reason
from palaestra.api.status import TERMINAL, ConditionType, Phase
from palaestra.objects import Object
from palaestra.operator import metric_definitions
from palaestra_protocol.metrics import Family, Values

Counted = TypeVar("Counted", Counter, Histogram)

# By default, the client library exports a second series for each counter: its creation time.
disable_created_metrics()


class Metrics:
    """The operator's metrics, in a registry that holds no other metrics."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self.reconciled = self._histogram(metric_definitions.RECONCILED)
        self._requests = self._counter(metric_definitions.REQUESTS)
        self._request_seconds = self._histogram(metric_definitions.REQUEST_DURATION)
        self._queued = self._histogram(metric_definitions.QUEUE_WAIT)
        self._time_to_running = self._histogram(metric_definitions.TIME_TO_RUNNING)
        self._restarts = self._counter(metric_definitions.RESTARTS)
        self._ends = self._counter(metric_definitions.REPLICA_ENDS)
        ProcessCollector(registry=self.registry)

    def request(self, verb: str, resource: str, code: int, seconds: float) -> None:
        """Count a request; `code` is 0 without a response, and `seconds` is the duration of the request."""
        self._requests.labels(verb, resource, str(code)).inc()
        if verb != "watch":
            self._request_seconds.labels(verb).observe(seconds)

    def waited(self, seconds: float) -> None:
        """Record the seconds that a key waited in the queue."""
        self._queued.observe(seconds)

    def written(self, job: Object, status: Object) -> None:
        """Count the changes between the old status of a TrainingJob and the written status.

        Only the operator that wrote the status counts its changes, so no change is counted twice.
        """
        old = job.get("status") or {}
        if status["phase"] == Phase.RUNNING and not _has_run(old):
            waited = _running_since(status) - _time(job["metadata"]["creationTimestamp"])
            self._time_to_running.observe(max(waited.total_seconds(), 0.0))
        before = {replica["index"]: replica for replica in old.get("replicas", ())}
        for replica in status.get("replicas", ()):
            self._count_replica(before.get(replica["index"], {}), replica)

    def watch(
        self,
        *,
        depth: Callable[[], int],
        leads: Callable[[], bool],
        phases: Callable[[], Iterable[tuple[str, str]]],
        waits: Callable[[], Iterable[tuple[str, str]]],
        outdated: Callable[[], bool | None],
    ) -> None:
        """Export the gauges that these functions return; each scrape calls them."""
        self.registry.register(_Now(depth, leads, phases, waits, outdated))

    def text(self) -> bytes:
        """Return all metrics in the text format of Prometheus."""
        return generate_latest(self.registry)

    def _count_replica(self, old: Object, new: Object) -> None:
        before = old.get("restarts") or {}
        for cause, times in new["restarts"].items():
            self._restarts.labels(cause).inc(max(times - before.get(cause, 0), 0))
        if new["phase"] in TERMINAL and old.get("phase") not in TERMINAL:
            reason = new.get("reason")
            self._ends.labels(reason if reason in metric_definitions.ENDS else Reason.JOB_FAILED).inc()

    def _histogram(self, family: Family) -> Histogram:
        made = Histogram(
            family.name, family.meaning, family.label_names, buckets=family.buckets, registry=self.registry
        )
        return _from_zero(made, family)

    def _counter(self, family: Family) -> Counter:
        made = Counter(family.name, family.meaning, family.label_names, registry=self.registry)
        return _from_zero(made, family)


class _Now(Collector):
    """Gauges that are read at each scrape, so that a deleted job leaves no series behind."""

    def __init__(
        self,
        depth: Callable[[], int],
        leads: Callable[[], bool],
        phases: Callable[[], Iterable[tuple[str, str]]],
        waits: Callable[[], Iterable[tuple[str, str]]],
        outdated: Callable[[], bool | None],
    ) -> None:
        self._depth = depth
        self._leads = leads
        self._phases = phases
        self._waits = waits
        self._outdated = outdated

    def collect(self) -> Iterator[Metric]:
        """Yield each metric family; only the leader exports gauges of jobs, so each job counts once."""
        leads = self._leads()
        yield metric_definitions.JOBS.metric(_by_phase(self._phases()) if leads else {})
        yield metric_definitions.REPLICAS_WAITING.metric(dict(Count(self._waits())) if leads else {})
        yield metric_definitions.QUEUE_DEPTH.metric({(): self._depth()})
        yield metric_definitions.LEADER.metric({(): leads})
        outdated = self._outdated()
        yield metric_definitions.CRD_OUTDATED.metric({} if outdated is None else {(): outdated})
        yield metric_definitions.BUILD.metric({(version("palaestra"),): 1})


def _from_zero(made: Counted, family: Family) -> Counted:
    """Return a metric with one series of 0 for each label value, so the first event is an increase."""
    for values in family.combinations() if family.labels else ():
        made.labels(*values)
    return made


def _by_phase(jobs: Iterable[tuple[str, str]]) -> Values:
    """Return the number of jobs by namespace and phase."""
    counted = Count(jobs)
    namespaces = sorted({namespace for namespace, _ in counted})
    return {(namespace, phase): counted[namespace, phase] for namespace in namespaces for phase in Phase}


def _has_run(status: Object) -> bool:
    """Return whether a job has already run, derived from its phase and its replicas' attempts."""
    begun = (replica.get("attempt", 0) > 1 or "target" in replica for replica in status.get("replicas", ()))
    return status.get("phase") == Phase.RUNNING or any(begun)


def _running_since(status: Object) -> datetime:
    times = {condition["type"]: condition["lastTransitionTime"] for condition in status["conditions"]}
    return _time(times[ConditionType.RUNNING])


def _time(text: str) -> datetime:
    return datetime.fromisoformat(text)
