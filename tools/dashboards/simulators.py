"""Simulators: do they break, are they fast enough, do they leak."""

from grafana_foundation_sdk.models import units

from tools.dashboards.board import Board, Section
from tools.dashboards.metrics import RUN, RUN_CHOICES, grown, of_run, quantile, rate, total
from tools.dashboards.panels import Look, Panel, Query

_BY_ONE = "namespace, training_job, replica, simulator"
_ONE = RUN + " {{simulator}}"


def board() -> Board:
    """Return the dashboard."""
    return Board(
        name="simulators",
        says="Whether the simulators of the chosen runs break, keep up and stay within their memory.",
        since="now-1h",
        variables=RUN_CHOICES,
        sections=(
            Section("Are they there?", (_available(), _states(), _up())),
            Section("Do they break?", (_faults(), _restarts(), _budget(), _exits(), _starts())),
            Section(
                "Are they fast enough?", (_factor(), _latency(), _spread(), _slow(), _simulated(), _resets())
            ),
            Section("What do they need?", (_memory(), _cores())),
        ),
    )


def _available() -> Panel:
    return Panel(
        question="With how many does it train?",
        says=(
            "As the trainer sees them. starting: being mended or on their way. given_up: broke more often "
            "than restart.limit; the run goes on with the rest while minSimulators are left."
        ),
        unit=units.Short,
        look=Look.SHARES,
        least=0,
        queries=(Query(total("role, state", of_run("palaestra_trainer_simulators")), "{{role}} {{state}}"),),
    )


def _states() -> Panel:
    return Panel(
        question="In which states are their processes?",
        says=(
            "As the sidecars see them. Long in starting: the world is large, or the CPU limit small. In "
            "failed: it did not come up; read the log of the container sim-<group>-<i>."
        ),
        unit=units.Short,
        look=Look.SHARES,
        least=0,
        queries=(Query(total("state", of_run("palaestra_simulator_state")), "{{state}}"),),
    )


def _up() -> Panel:
    return Panel(
        question="Does each have a process?",
        says="1 for each simulator, b for its standby. 0: it is being restarted, or waits for the trainer.",
        unit=units.Short,
        least=0,
        most=1,
        queries=(Query(of_run("palaestra_simulator_up"), f"{_ONE} {{{{slot}}}}"),),
    )


def _faults() -> Panel:
    faults = rate(of_run("palaestra_simulator_faults_total", 'kind!="slow"'))
    return Panel(
        question="Which faults do they have?",
        says=(
            "Faults in a minute. dead: its process ended; hung: no answer in time; wrong_data: not finite, "
            "or of a wrong size. One simulator only: its world or its node; all of them: the image."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(f"{total('simulator, kind', faults)} * 60 > 0", "{{simulator}} {{kind}}"),),
    )


def _restarts() -> Panel:
    restarts = of_run("palaestra_simulator_restarts_total")
    return Panel(
        question="Why are they restarted?",
        says=(
            "Restarts since the trainer began. recycled is by choice: resets, age or memory reached a limit "
            "of the job's `recycle`. All else followed a fault."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(total("simulator, cause", restarts) + " > 0", "{{simulator}} {{cause}}"),),
    )


def _budget() -> Panel:
    return Panel(
        question="How much of the restart budget is spent?",
        says=(
            "Restarts after faults within restart.withinSeconds, by restart.limit. At 1 the next fault gives "
            "the simulator up, and may end the run. Above 0.7 it is an alert: find the cause of the faults."
        ),
        unit=units.PercentUnit,
        least=0,
        most=1,
        alarm=0.7,
        queries=(Query(of_run("palaestra_simulator_restart_budget_spent_ratio"), _ONE),),
    )


def _exits() -> Panel:
    exits = of_run("palaestra_simulator_unexpected_exits_total")
    return Panel(
        question="How do their processes end?",
        says=(
            "Ends that nobody asked for, since the sidecar began. signal: killed, for its memory perhaps; "
            "code: it gave up by itself, its log says why."
        ),
        unit=units.Short,
        least=0,
        width=12,
        queries=(Query(total("simulator, kind", exits) + " > 0", "{{simulator}} {{kind}}"),),
    )


def _starts() -> Panel:
    return Panel(
        question="How often were they started?",
        says="Since the sidecar began; 1 is the start itself. It rises with every restart, wanted or not.",
        unit=units.Short,
        least=0,
        width=12,
        queries=(Query(of_run("palaestra_simulator_starts_total"), f"{_ONE} {{{{slot}}}}"),),
    )


def _factor() -> Panel:
    simulated = rate(of_run("palaestra_simulator_simulated_seconds_total"))
    waited = rate(of_run("palaestra_simulator_step_duration_seconds_sum"))
    return Panel(
        question="How much faster than real time are they?",
        says=(
            "Simulated seconds for each second of stepping. Below 1 for long is an alert: give "
            "it more CPU, a simpler world or a longer basicTimeStep. It is empty while it is not stepped."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(f"{total(_BY_ONE, simulated)} / ({total(_BY_ONE, waited)} > 0)", _ONE),),
    )


def _latency() -> Panel:
    steps = of_run("palaestra_simulator_step_duration_seconds_bucket")
    return Panel(
        question="How long does one step take?",
        says=(
            "One environment step of one simulator, median and the slowest of a hundred. One simulator above "
            "the others makes them all wait: restart it, or look at its node."
        ),
        unit=units.Seconds,
        least=0,
        queries=(
            Query(quantile(0.5, _BY_ONE, steps), f"{_ONE} median"),
            Query(quantile(0.99, _BY_ONE, steps), f"{_ONE} q0.99"),
        ),
    )


def _spread() -> Panel:
    steps = of_run("palaestra_simulator_step_duration_seconds_bucket")
    return Panel(
        question="How are the steps' times spread?",
        says="How many steps took how long. A second band far above the first: something stalls at times.",
        unit=units.Seconds,
        look=Look.SPREAD,
        queries=(Query(total("le", grown(steps)), "{{le}}"),),
    )


def _slow() -> Panel:
    slow = rate(of_run("palaestra_simulator_faults_total", 'kind="slow"'))
    return Panel(
        question="How many steps are slow?",
        says=(
            "Steps in a minute that took ten times as long as its others, and more than 50 ms. They break "
            "nothing. At regular intervals: something else runs on the node, or it writes to a slow disk."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(f"{total(_BY_ONE, slow)} * 60", _ONE),),
    )


def _simulated() -> Panel:
    simulated = rate(of_run("palaestra_simulator_simulated_seconds_total"))
    return Panel(
        question="How much is simulated in a second?",
        says=(
            "Simulated seconds a second of all simulators together, learning and saving included: what the "
            "run gets for its cores. Compare it before and after a change of the job."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(total("namespace, training_job, replica", simulated), RUN),),
    )


def _resets() -> Panel:
    return Panel(
        question="How many episodes begin?",
        says=(
            "Resets a second, training and evaluation. A simulator with none takes no part: see its state. "
            "Many more than before: episodes end early."
        ),
        unit=units.OpsPerSecond,
        least=0,
        queries=(Query(rate(of_run("palaestra_simulator_resets_total")), _ONE),),
    )


def _memory() -> Panel:
    return Panel(
        question="Does its memory grow?",
        says=(
            "Memory of all processes of a simulator. It rises with every reset: it leaks; set `recycle` "
            "(aboveMemory, afterResets), which restarts it between episodes at no cost."
        ),
        unit=units.BytesIEC,
        least=0,
        width=12,
        queries=(Query(of_run("palaestra_simulator_rss_bytes"), f"{_ONE} {{{{slot}}}}"),),
    )


def _cores() -> Panel:
    return Panel(
        question="How many cores does it use?",
        says="CPU of all processes of a simulator. At the limit of its resources it is throttled: raise it.",
        unit=units.Short,
        least=0,
        width=12,
        queries=(Query(rate(of_run("palaestra_simulator_cpu_seconds_total")), f"{_ONE} {{{{slot}}}}"),),
    )
