"""The dashboard Operator: does an operator keep up, are its requests refused, and which operator leads."""

from grafana_foundation_sdk.models import units

from tools.dashboards.board import Board, Section, Variable
from tools.dashboards.metrics import quantile, rate, selected, total
from tools.dashboards.panels import Look, Panel, Query

_IS_OPERATOR = "palaestra_operator_build_info"


def board() -> Board:
    """Return the dashboard."""
    return Board(
        name="operator",
        says="Whether the operator keeps up, what the API server answers, and who leads.",
        since="now-6h",
        variables=(
            Variable(name="operator", metric=_IS_OPERATOR, label="namespace", says="Where operators run"),
        ),
        sections=(
            Section("Does an operator run?", (_leader(), _releases(), _uptime())),
            Section("Does it keep up?", (_depth(), _waits(), _looks(), _seconds(), _failed())),
            Section("What does it ask of the API server?", (_answers(), _refused(), _requests(), _latency())),
            Section("What does it need?", (_memory(), _cores())),
        ),
    )


def _of(metric: str, *matchers: str) -> str:
    """Return a metric of the chosen operators; on other dashboards, `namespace` is that of jobs."""
    return selected(metric, 'namespace=~"$operator"', *matchers)


def _of_process(expr: str) -> str:
    """Return a metric that every process exports, for operators only."""
    return f"{expr} and on (namespace, pod) {_of(_IS_OPERATOR)}"


def _leader() -> Panel:
    return Panel(
        question="Who leads?",
        says=(
            "1 for the pod that leads; the others wait. An alert fires if no pod leads for minutes: "
            "then read the operators' logs, and look at the Lease palaestra-operator."
        ),
        unit=units.Short,
        least=0,
        most=1,
        queries=(Query(_of("palaestra_operator_leader"), "{{pod}}"),),
    )


def _releases() -> Panel:
    return Panel(
        question="Which releases run?",
        says=(
            "Pods by release. If there are two releases for longer than an upgrade takes, the upgrade is "
            "stuck: describe the Deployment."
        ),
        unit=units.Short,
        look=Look.FIGURES,
        queries=(Query(total("version", _of(_IS_OPERATOR)), "{{version}}"),),
    )


def _uptime() -> Panel:
    return Panel(
        question="For how long have they run?",
        says=(
            "If it returns to zero again and again, the operator crashes: read `kubectl logs --previous` "
            "of the pod."
        ),
        unit=units.Seconds,
        least=0,
        queries=(Query(f"time() - ({_of_process(_of('process_start_time_seconds'))})", "{{pod}}"),),
    )


def _depth() -> Panel:
    return Panel(
        question="How many TrainingJobs wait for a worker?",
        says="It returns to zero. If it grows, the API server is slow, or the operator needs more workers.",
        unit=units.Short,
        least=0,
        queries=(Query(_of("palaestra_operator_queue_depth"), "{{pod}}"),),
    )


def _waits() -> Panel:
    waits = _of("palaestra_operator_queue_wait_seconds_bucket")
    return Panel(
        question="How long do they wait?",
        says=(
            "The median and the slowest of a hundred. If it is above a second, see how many jobs wait, "
            "and how long a reconcile takes."
        ),
        unit=units.Seconds,
        least=0,
        queries=(
            Query(quantile(0.5, "", waits), "median"),
            Query(quantile(0.99, "", waits), "q0.99"),
        ),
    )


def _looks() -> Panel:
    looks = _of("palaestra_operator_reconcile_duration_seconds_count")
    return Panel(
        question="How do its reconciles of a job end?",
        says=(
            "Reconciles per second. conflict is harmless: another client wrote meanwhile. error is not "
            "harmless: the log has `not reconciled` or `refused`, with the cause."
        ),
        unit=units.OpsPerSecond,
        least=0,
        queries=(Query(total("result", rate(looks)), "{{result}}"),),
    )


def _seconds() -> Panel:
    looks = _of("palaestra_operator_reconcile_duration_seconds_bucket")
    return Panel(
        question="How long is one reconcile?",
        says=(
            "The median and the slowest of a hundred; nearly all of the time is spent waiting for the API "
            "server."
        ),
        unit=units.Seconds,
        least=0,
        width=12,
        queries=(
            Query(quantile(0.5, "", looks), "median"),
            Query(quantile(0.99, "", looks), "q0.99"),
        ),
    )


def _failed() -> Panel:
    looks = "palaestra_operator_reconcile_duration_seconds_count"
    errors = _of(looks, 'result="error"')
    return Panel(
        question="Which share of its reconciles fails?",
        says="After ten minutes above 0 an alert fires; the log has `not reconciled` or `refused`.",
        unit=units.PercentUnit,
        least=0,
        width=12,
        queries=(Query(f"(sum({rate(errors)}) or vector(0)) / sum({rate(_of(looks))})", "failed"),),
    )


def _answers() -> Panel:
    requests = _of("palaestra_operator_requests_total")
    return Panel(
        question="What does the API server answer?",
        says=(
            "Responses a second by code. 0: no response. 403: a right is missing; install the chart "
            "again. 409: harmless. 429: the operator is throttled."
        ),
        unit=units.RequestsPerSecond,
        least=0,
        width=6,
        queries=(Query(total("code", rate(requests)), "{{code}}"),),
    )


def _refused() -> Panel:
    requests = "palaestra_operator_requests_total"
    refused = _of(requests, 'code=~"0|4..|5.."', 'code!~"404|409"')
    return Panel(
        question="Which share of its requests fails?",
        says=(
            "Failures that are part of its work (404, 409) are not counted. If it is above zero, see the "
            "codes, then the operator's log."
        ),
        unit=units.PercentUnit,
        least=0,
        width=6,
        queries=(Query(f"(sum({rate(refused)}) or vector(0)) / sum({rate(_of(requests))})", "failed"),),
    )


def _requests() -> Panel:
    requests = _of("palaestra_operator_requests_total")
    return Panel(
        question="What does it ask for?",
        says=(
            "Requests a second by verb and resource. While no job changes, the operator only renews "
            "its Lease; if there are more requests, something changes the jobs all the time."
        ),
        unit=units.RequestsPerSecond,
        least=0,
        width=6,
        queries=(Query(total("verb, resource", rate(requests)), "{{verb}} {{resource}}"),),
    )


def _latency() -> Panel:
    requests = _of("palaestra_operator_request_duration_seconds_bucket")
    return Panel(
        question="How long does an answer take?",
        says=(
            "The slowest of a hundred, by verb, without watches. If it is above a second, the API server "
            "is loaded."
        ),
        unit=units.Seconds,
        least=0,
        width=6,
        queries=(Query(quantile(0.99, "verb", requests), "{{verb}}"),),
    )


def _memory() -> Panel:
    return Panel(
        question="Does its memory grow?",
        says=(
            "It grows with the number of jobs: 49 MiB without any, 18 MiB for each 1,000 planned, 2.4 "
            "MiB for each 1,000 finished. If it grows while the number of jobs does not, please "
            "report it."
        ),
        unit=units.BytesIEC,
        least=0,
        width=12,
        queries=(Query(_of_process(_of("process_resident_memory_bytes")), "{{pod}}"),),
    )


def _cores() -> Panel:
    cpu = rate(_of("process_cpu_seconds_total"))
    return Panel(
        question="How many cores does it use?",
        says=(
            "If it is at the limit of its resources, the operator is throttled and jobs wait: raise the "
            "limit."
        ),
        unit=units.Short,
        least=0,
        width=12,
        queries=(Query(_of_process(cpu), "{{pod}}"),),
    )
