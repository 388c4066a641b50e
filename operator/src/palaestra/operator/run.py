"""Assemble the operator, run it until a signal, and stop it within two seconds.

This module connects the other modules of the package. Reflectors watch the cluster from the start, so that a
new leader can work at once. Workers reconcile only while the caches are complete and this operator leads.
"""

import logging
import signal
import socket
import sys
import threading
import uuid
from collections.abc import Collection
from typing import Any

import structlog

from palaestra.cluster import Api, Leadership, Recorder, WorkQueue, connect
from palaestra.objects import Key
from palaestra.operator import health
from palaestra.operator.caches import Caches
from palaestra.operator.controller import Controller
from palaestra.operator.crd_check import CrdCheck
from palaestra.operator.executor import Executor
from palaestra.operator.fenced_client import FencedClient
from palaestra.operator.metrics import Metrics
from palaestra.operator.observer import JobObserver
from palaestra.operator.options import NAME, OperatorOptions
from palaestra.operator.poll_schedule import PollTarget
from palaestra.operator.poller import Poller
from palaestra.operator.status_writer import StatusWriter
from palaestra.operator.unused_claims import UnusedClaims
from palaestra.operator.unwatched_facts import ForeignJobs, RejectedCreations
from palaestra.operator.workers import Workers
from palaestra.operator.world_check_process import WorldCheckProcess
from palaestra.operator.world_verdicts import WorldChecker
from palaestra.plan import ClusterLayout
from palaestra.plan.layout import USER
from palaestra_protocol.masking import masked
from palaestra_protocol.signals import set_at_signals

log = structlog.get_logger(__name__)

# The operator stops within two seconds: these deadlines are for the workers, the Lease, and each other part.
FINISH_S, RELEASE_S, STOP_S = 0.6, 0.6, 0.1
SYNC_S = 1.0
SETTLES_S = 0.1  # delay of a reconcile after a change; meanwhile the caches receive related changes
FAILED = 1
_JSON = structlog.processors.JSONRenderer(default=str)


class Operator:
    """A running operator.

    Args:
        api: the cluster.
        options: the options of the command line.
        metrics: the metrics that this operator updates.
    """

    def __init__(self, api: Api, options: OperatorOptions, metrics: Metrics) -> None:
        self._options = options
        self._gate = threading.Event()
        api.on_request = metrics.request
        self._queue: WorkQueue[Key] = WorkQueue(waited=metrics.waited, lane=_namespace)
        self._caches = Caches(api, options.namespaces, self._changed)
        self._definition = CrdCheck(api, self._look_at_all)
        self._poller = Poller(self._trainers, self._queue.add)
        identity = f"{socket.gethostname()}_{uuid.uuid4().hex[:8]}"
        self._leadership = Leadership(api, options.operator_namespace, NAME, identity)
        self._writer = writer = FencedClient(api, self._term)
        strangers, denials = ForeignJobs(api), RejectedCreations()
        self._apart = WorldCheckProcess()
        self._checking = WorldChecker(self._apart.check, self._queue.add)
        self._controller = Controller(
            self._caches,
            JobObserver(api, self._caches, strangers, denials, self._poller.known, self._checking),
            Executor(api, writer, strangers, denials),
            StatusWriter(
                writer, Recorder(api, instance=identity), metrics.written, self._definition.accepted
            ),
            _layout(options),
        )
        self._tidying = UnusedClaims(api, self._caches, writer)
        self._workers = Workers(
            self._queue,
            self._reconcile,
            gate=self._gate,
            seconds=metrics.reconciled,
            count=options.workers,
        )
        metrics.watch(
            depth=lambda: self._queue.depth,
            leads=self._leads,
            phases=self._caches.phases,
            waits=self._caches.waits,
            outdated=lambda: self._definition.outdated,
        )
        self._server = health.serving(
            options.metrics_address, healthy=self._unhealthy, ready=self._not_ready, metrics=metrics.text
        )

    def run(self, stopping: threading.Event) -> None:
        """Reconcile jobs until `stopping` is set."""
        log.info("started", namespaces=self._options.namespaces or "all", address=str(self._server.address))
        self._definition.follow(stopping, self._options.resync_s)
        self._caches.start()
        self._workers.start()
        self._checking.start()
        self._poller.start()
        try:
            while not stopping.is_set() and not self._caches.wait_synced(SYNC_S):
                log.info("waits for the first lists", missing=self._caches.missing())
            self._stand()
            while not stopping.wait(self._options.resync_s):
                self._look_at_all()
        finally:
            self._end()

    def _changed(self, key: Key) -> None:
        self._queue.add_after(key, SETTLES_S)

    def _stand(self) -> None:
        """Lead, or join the leader election; call it after the caches are complete."""
        if self._options.leader_elect:
            self._leadership.start(self._lead, self._gate.clear, self._look_at_all)
        else:
            self._lead()

    def _lead(self) -> None:
        self._controller.begin_anew()
        self._look_at_all()
        self._gate.set()

    def _reconcile(self, key: Key) -> float | None:
        self._writer.begin()
        again_s = self._controller.reconcile(key)
        self._tidying.tidy(key)
        return again_s

    def _leads(self) -> bool:
        return self._term() is not None

    def _term(self) -> int | None:
        if self._options.leader_elect:
            return self._leadership.term()
        return None if self._queue.closed else 0

    def _look_at_all(self) -> None:
        for key in self._caches.known():
            self._queue.add(key)

    def _trainers(self) -> Collection[PollTarget]:
        return self._caches.trainers() if self._gate.is_set() else ()

    def _unhealthy(self) -> str | None:
        return self._workers.trouble()

    def _not_ready(self) -> str | None:
        missing = self._caches.missing()
        return f"not read yet: {', '.join(missing)}" if missing else None

    def _end(self) -> None:
        """Stop in the safe order: first all writes end, then the Lease is released, then the reads end."""
        self._gate.clear()
        self._checking.stop()
        self._apart.stop()
        self._workers.stop(FINISH_S)
        self._leadership.stop(RELEASE_S)
        self._poller.stop(STOP_S)
        self._caches.stop(STOP_S)
        log.info("ended")


def run(options: OperatorOptions, metrics: Metrics | None = None) -> int:
    """Run the operator until SIGTERM or SIGINT; return its exit code, which is 1 if a thread failed.

    Raises:
        PalaestraError: no API server is configured, or the address of the metrics is in use.
    """
    configure_logs()
    stopping = threading.Event()
    broken: list[str] = []

    def break_down(failed: threading.ExceptHookArgs) -> None:
        """Stop the operator if a thread fails: a restart is better than an operator without the thread."""
        broken.append(failed.thread.name if failed.thread else "")
        log.critical("thread failed", thread=broken[-1], exc_info=failed.exc_value)
        stopping.set()

    threading.excepthook = break_down
    set_at_signals(stopping, (signal.SIGTERM, signal.SIGINT))
    operator = Operator(connect(options.kubeconfig, options.context), options, metrics or Metrics())
    operator.run(stopping)
    return FAILED if broken else 0


def _namespace(key: Key) -> str:
    return key[0]


def _layout(options: OperatorOptions) -> ClusterLayout:
    return ClusterLayout(
        images=options.images,
        operator_namespace=options.operator_namespace,
        monitoring_namespace=options.monitoring_namespace,
        node_selector=options.node_selector,
        host_users=options.host_users,
        allowed=options.allowed,
        resources=options.resources,
        user=USER if options.fixed_user else None,
        has_webots_image=options.has_webots_image,
    )


def configure_logs() -> None:
    """Configure the log: standard error gets one JSON object a line, with its level and the time in UTC.

    The message of each log call is constant; its values are separate fields.
    """
    structlog.configure(
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.dict_tracebacks,
            _render,
        ],
        logger_factory=lambda *_: structlog.PrintLogger(sys.stderr),
    )


def _render(logger: Any, name: str, fields: structlog.typing.EventDict) -> str:
    """Return the log line as JSON, with user names and passwords in URLs masked."""
    return masked(str(_JSON(logger, name, fields)))
