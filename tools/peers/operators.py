"""The chapter about operators of other projects; a kind's figure is the sum over its operators."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tools.peers.rows import Chapter, Figures, Get, Row, always, at

OURS = "training_jobs"
WITH_OPERATORS = {"job_sets": "JobSet", "train_jobs": "Kubeflow Trainer"}
ALL = {"jobs_alone": "Jobs without an operator"} | WITH_OPERATORS
OF_THE_CONTROL_PLANE = ("etcd", "kube-apiserver", "kube-controller-manager")

GetOfKind = Callable[[str], Get]


def _of_api_server(figure: str) -> GetOfKind:
    return lambda kind: at(kind, "programs", "kube-apiserver", figure)


def _of_operators(figure: str) -> GetOfKind:
    """Return a function that returns, for a kind of object, the sum of a figure over its operators."""

    def of_kind(kind: str) -> Get:
        def get(figures: Figures) -> float:
            programs = figures[kind]["programs"].items()
            found = [float(each[figure]) for name, each in programs if name not in OF_THE_CONTROL_PLANE]
            return round(sum(found), 1)

        return get

    return of_kind


def _rows(what: str, get: GetOfKind, unit: str, others: dict[str, str] = WITH_OPERATORS) -> Iterator[Row]:
    """Yield a row of a figure for each other kind of object."""
    for kind, name in others.items():
        yield Row(what=f"{what}: {name}", ours=get(OURS), theirs=get(kind), unit=unit)


CHAPTER = Chapter(
    part="operators",
    title="Other operators",
    text=(
        "A client creates 1,000 objects in a control plane without nodes, one control plane for each kind "
        "of object. Each object makes one Job with one pod; the pods of all kinds have the same size. A "
        "TrainJob of Kubeflow Trainer makes a JobSet, so its figures are the sums of both operators."
    ),
    rows=always(
        *_rows("until the last pod exists", lambda kind: at(kind, "seconds_to_the_last_pod"), "s", ALL),
        *_rows("processor time of the operators for one object", _of_operators("cpu_ms_a_job"), "ms"),
        *_rows("peak memory of the operators", _of_operators("peak_rss_mib"), "MiB"),
        *_rows("the operators' requests that write one object", _of_operators("writes_a_job"), "requests"),
        *_rows("processor time of the API server for one object", _of_api_server("cpu_ms_a_job"), "ms", ALL),
        *_rows("peak memory of the API server", _of_api_server("peak_rss_mib"), "MiB", ALL),
    ),
    limit=(
        "No pod runs, so no operator observes a training. A TrainingJob also has objects, a status and "
        "events that the others do not have. The Job controller may send 500 requests a second."
    ),
    reason=(
        "A TrainingJob also has a NetworkPolicy, a ConfigMap, a PersistentVolumeClaim, a status and events: "
        "[memory and requests of the operator](../reference/operator.md)."
    ),
)
