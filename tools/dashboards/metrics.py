"""Metrics with matchers for their labels, which the choices at the top of a dashboard set.

`training_job`, `replica` and `simulator` are labels of the target: the PodMonitor takes them from the pod.
"""

from typing import Final

from tools.dashboards.board import Variable

RATE: Final = "$__rate_interval"
RUN: Final = "{{training_job}}/{{replica}}"  # the legend where each run has one line
_CHOSEN: Final = ('namespace=~"$namespace"', 'training_job=~"$job"', 'replica=~"$replica"')

RUN_CHOICES: Final = (
    Variable(
        name="namespace",
        metric="palaestra_trainer_target_steps",
        label="namespace",
        says="Where the TrainingJobs are",
    ),
    Variable(
        name="job",
        metric='palaestra_trainer_target_steps{namespace=~"$namespace"}',
        label="training_job",
        says="The TrainingJobs' names",
    ),
    Variable(
        name="replica",
        metric='palaestra_trainer_target_steps{namespace=~"$namespace", training_job=~"$job"}',
        label="replica",
        says="One run of a job, with a seed of its own",
    ),
)


def selected(metric: str, *matchers: str) -> str:
    """Return a metric with these matchers."""
    return f"{metric}{{{', '.join(matchers)}}}"


def of_run(metric: str, *matchers: str) -> str:
    """Return a metric of the chosen runs."""
    return selected(metric, *_CHOSEN, *matchers)


def of_namespace(metric: str, *matchers: str) -> str:
    """Return a metric of all targets in the chosen namespaces."""
    return selected(metric, 'namespace=~"$namespace"', *matchers)


def of_jobs(metric: str, *matchers: str) -> str:
    """Return a metric of the operator, about jobs in the chosen namespaces."""
    return selected(metric, 'job_namespace=~"$namespace"', *matchers)


def rate(counter: str, over: str = RATE) -> str:
    """Return a query for the growth of a counter per second."""
    return f"rate({counter}[{over}])"


def grown(counter: str, over: str = RATE) -> str:
    """Return a query for the growth of a counter in the time `over`."""
    return f"increase({counter}[{over}])"


def total(by: str, expr: str) -> str:
    """Return the sums by these labels, which are separated by commas."""
    return f"sum by ({by}) ({expr})"


def quantile(q: float, by: str, buckets: str, over: str = RATE) -> str:
    """Return a quantile of the recent values of a histogram."""
    labels = f"{by}, le" if by else "le"
    return f"histogram_quantile({q:g}, {total(labels, rate(buckets, over))})"
