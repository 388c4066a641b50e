"""Fleet: how many jobs there are, how long they wait, and what a million steps cost."""

from grafana_foundation_sdk.models import units

from tools.dashboards.board import Board, Section, Variable
from tools.dashboards.metrics import grown, of_jobs, of_namespace, quantile, rate, total
from tools.dashboards.panels import Look, Panel, Query

_LONG = "30m"  # a shorter time range would show each evaluation and each checkpoint as a jump
_OF_RUNS = 'training_job!=""'


def board() -> Board:
    """Return the dashboard."""
    return Board(
        name="fleet",
        says="All TrainingJobs of the chosen namespaces: how many, how long they wait, what they cost.",
        since="now-24h",
        variables=(
            Variable(
                name="namespace", metric="palaestra_jobs", label="job_namespace", says="Where the jobs are"
            ),
        ),
        sections=(
            Section("How many are there?", (_phases(), _namespaces(), _pending())),
            Section("Do they succeed?", (_ends(), _restarts(), _waits())),
            Section("What do they cost?", (_steps(), _cores(), _cost(), _useful())),
        ),
    )


def _phases() -> Panel:
    return Panel(
        question="In which phases are the jobs?",
        says="TrainingJobs that exist now; a job that has ended stays until its time to live is over.",
        unit=units.Short,
        look=Look.SHARES,
        least=0,
        queries=(Query(total("phase", of_jobs("palaestra_jobs")), "{{phase}}"),),
    )


def _namespaces() -> Panel:
    running = of_jobs("palaestra_jobs", 'phase="Running"')
    return Panel(
        question="Whose jobs run?",
        says=(
            "Running jobs by namespace. If one namespace has them all while others wait, set quotas or a "
            "queue."
        ),
        unit=units.Short,
        look=Look.SHARES,
        least=0,
        queries=(Query(total("job_namespace", running), "{{job_namespace}}"),),
    )


def _pending() -> Panel:
    waiting = of_jobs("palaestra_jobs", 'phase=~"Pending|Suspended"')
    return Panel(
        question="Whose jobs wait?",
        says=(
            "Pending and suspended jobs by namespace. If a job is pending for long, `kubectl describe "
            "tj` shows what is missing: free resources, a quota, a volume, an image."
        ),
        unit=units.Short,
        look=Look.SHARES,
        least=0,
        queries=(Query(total("job_namespace, phase", waiting), "{{job_namespace}} {{phase}}"),),
    )


def _ends() -> Panel:
    ends = grown("palaestra_replica_ends_total", "$__range")
    return Panel(
        question="How did replicas end?",
        says=(
            "Ends over the time shown, in all namespaces, by reason. The operations page has the "
            "remedy for each reason; `kubectl get tj -A` shows which jobs they were."
        ),
        unit=units.Short,
        look=Look.FIGURES,
        queries=(Query(f"{total('reason', ends)} > 0", "{{reason}}"),),
    )


def _restarts() -> Panel:
    restarts = grown("palaestra_replica_restarts_total", "$__range")
    return Panel(
        question="Why did replicas begin again?",
        says=(
            "Restarts over the time shown, in all namespaces. disruption: nodes were drained or "
            "preempted; suspension: a queue let other jobs run; trainer, simulator: see the job's "
            "events."
        ),
        unit=units.Short,
        look=Look.FIGURES,
        queries=(Query(total("cause", restarts), "{{cause}}"),),
    )


def _waits() -> Panel:
    waits = "palaestra_job_time_to_running_seconds_bucket"
    return Panel(
        question="How long until a job runs?",
        says=(
            "Time from a job's creation until its first pod starts, queueing included: the median and "
            "the slowest of ten, over the time shown. If it takes minutes without a queue, images "
            "are being pulled or the cluster is full."
        ),
        unit=units.Seconds,
        look=Look.FIGURES,
        queries=(
            Query(quantile(0.5, "", waits, "$__range"), "median"),
            Query(quantile(0.9, "", waits, "$__range"), "q0.9"),
        ),
    )


def _steps() -> Panel:
    return Panel(
        question="How many steps does the fleet make in a second?",
        says="Valid steps of all runs, by namespace. If it falls with equally many jobs, see Simulators.",
        unit=units.OpsPerSecond,
        least=0,
        width=6,
        queries=(
            Query(total("namespace", of_namespace("palaestra_trainer_steps_per_second")), "{{namespace}}"),
        ),
    )


def _cores() -> Panel:
    return Panel(
        question="How many cores do they use?",
        says=(
            "Trainers, sidecars and simulators, by namespace. If they use far less than they request, "
            "request less."
        ),
        unit=units.Short,
        least=0,
        width=6,
        queries=(Query(_cores_by("namespace", "$__rate_interval"), "{{namespace}}"),),
    )


def _cost() -> Panel:
    by = "namespace, training_job"
    steps = total(by, rate(of_namespace("palaestra_trainer_steps_total"), _LONG))
    return Panel(
        question="What do a million steps cost in core-hours?",
        says=(
            "Over the last half hour, evaluations included. If a job costs far more than similar "
            "jobs, its simulators are slow or break (Simulators), or it spends its time learning "
            "(Training)."
        ),
        unit=units.Short,
        least=0,
        width=6,
        queries=(
            Query(f"({_cores_by(by, _LONG)}) / ({steps} > 0) * 1e6 / 3600", "{{namespace}}/{{training_job}}"),
        ),
    )


def _useful() -> Panel:
    spent = "palaestra_trainer_seconds_total"
    useful = rate(of_namespace(spent, 'cause=~"stepping|transport|learning"'))
    every = rate(of_namespace(spent))
    return Panel(
        question="Which share of the time is training?",
        says=(
            "Stepping, transport and learning, by namespace; the rest is evaluating, saving, "
            "starting, recovering and recycling. If it falls, see where the time of its runs goes "
            "(Training)."
        ),
        unit=units.PercentUnit,
        least=0,
        most=1,
        width=6,
        queries=(Query(f"{total('namespace', useful)} / {total('namespace', every)}", "{{namespace}}"),),
    )


def _cores_by(labels: str, over: str) -> str:
    """Return the cores that runs use, as a sum: a sidecar's own CPU does not contain its simulator's CPU."""
    ours = total(labels, rate(of_namespace("process_cpu_seconds_total", _OF_RUNS), over))
    theirs = total(labels, rate(of_namespace("palaestra_simulator_cpu_seconds_total"), over))
    return f"{ours} + {theirs}"
