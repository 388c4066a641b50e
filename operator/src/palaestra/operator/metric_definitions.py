"""The definitions of the operator's metrics; `palaestra.operator.metrics` has their values.

Labels have few values. No label contains the name of a job, because the series would outlive the job. The
metrics of a training come from the pods of its job.
"""

from palaestra.api.reason_texts import ROWS
from palaestra.api.reasons import WAITING, Reason
from palaestra.api.status import Phase, Restarts
from palaestra_protocol.metrics import Family, Label, counter, gauge, histogram

SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)
# Buckets in seconds for the time from a job's creation until it first runs. They range from a start on a node
# that has all images to a night in a queue.
WAITS = (1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0, 14_400.0)
RESULTS = ("done", "conflict", "error")
# The reasons with which a replica may end: success, and every reason that is a warning.
ENDS = tuple(reason for reason in Reason if reason is Reason.SUCCEEDED or ROWS[reason].warning)

VERB = Label(name="verb", values=("get", "list", "watch", "create", "patch", "apply", "delete"))

JOBS = gauge(
    "palaestra_jobs",
    "TrainingJobs by namespace and phase; only the leading operator exports them.",
    Label(name="job_namespace", bound="namespace with jobs"),
    Label(name="phase", values=tuple(Phase)),
)
REPLICAS_WAITING = gauge(
    "palaestra_replicas_waiting",
    "Replicas that wait until the cluster or a person removes a problem, by the reason in their status.",
    Label(name="job_namespace", bound="namespace with jobs"),
    Label(name="reason", values=WAITING),
)
TIME_TO_RUNNING = histogram(
    "palaestra_job_time_to_running_seconds",
    "Time from a TrainingJob's creation until it first ran, including queues and image pulls.",
    WAITS,
)
RESTARTS = counter(
    "palaestra_replica_restarts_total",
    "Restarts of pods by cause; cause simulator counts restarts of simulators in a pod.",
    Label(name="cause", values=tuple(Restarts.model_fields)),
)
REPLICA_ENDS = counter(
    "palaestra_replica_ends_total",
    "Replicas that ended, by the reason in their status.",
    Label(name="reason", values=ENDS),
)
RECONCILED = histogram(
    "palaestra_operator_reconcile_duration_seconds",
    "Time that one reconcile of a TrainingJob took; the result conflict is harmless, error is not.",
    SECONDS,
    Label(name="result", values=RESULTS),
)
QUEUE_DEPTH = gauge("palaestra_operator_queue_depth", "TrainingJobs that wait for a worker.")
QUEUE_WAIT = histogram(
    "palaestra_operator_queue_wait_seconds", "Time that a TrainingJob waited for a worker.", SECONDS
)
REQUESTS = counter(
    "palaestra_operator_requests_total",
    "Requests to the API server; code 0: the API server did not respond.",
    VERB,
    Label(name="resource", bound="kind of object"),
    Label(name="code", bound="HTTP status that occurred"),
)
REQUEST_DURATION = histogram(
    "palaestra_operator_request_duration_seconds",
    "Time that a request to the API server took, without watches.",
    SECONDS,
    VERB,
)
LEADER = gauge("palaestra_operator_leader", "1 while this operator leads.")
CRD_OUTDATED = gauge(
    "palaestra_operator_crd_outdated",
    "1 while the cluster's CustomResourceDefinition lacks a field of this release; absent: not read yet.",
)
BUILD = gauge(
    "palaestra_operator_build_info",
    "Always 1; the label is the release.",
    Label(name="version", bound="release"),
)

FAMILIES: tuple[Family, ...] = (
    JOBS,
    REPLICAS_WAITING,
    TIME_TO_RUNNING,
    RESTARTS,
    REPLICA_ENDS,
    RECONCILED,
    QUEUE_DEPTH,
    QUEUE_WAIT,
    REQUESTS,
    REQUEST_DURATION,
    LEADER,
    CRD_OUTDATED,
    BUILD,
)
