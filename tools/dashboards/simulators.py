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
            Section("Do the simulators run?", (_available(), _states(), _up())),
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
            "The trainer's view. starting: they start or restart. given_up: they failed more often "
            "than restart.limit; the run continues with the rest while minSimulators are left."
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
            "The sidecars' view. If one is in starting for long, its world is large or its CPU limit "
            "is small. If one is in failed, it did not start: read the log of the container "
            "sim-<group>-<i>."
        ),
        unit=units.Short,
        look=Look.SHARES,
        least=0,
        queries=(Query(total("state", of_run("palaestra_simulator_state")), "{{state}}"),),
    )


def _up() -> Panel:
    return Panel(
        question="Does each have a process?",
        says="1 for each simulator; slot b is its standby. 0: it restarts, or waits for the trainer.",
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
            "Faults in a minute. dead: its process ended; hung: no response in time; wrong_data: not "
            "finite, or of a wrong size. If only one simulator has them, the cause is its world or "
            "its node; if all have them, it is the image."
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
            "Restarts since the trainer began. recycled restarts are planned: resets, age or memory "
            "reached a limit of the job's `recycle`. All others followed a fault."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(total("simulator, cause", restarts) + " > 0", "{{simulator}} {{cause}}"),),
    )


def _budget() -> Panel:
    return Panel(
        question="How much of the restart budget is spent?",
        says=(
            "Restarts after faults within restart.withinSeconds, divided by restart.limit. At 1, the "
            "trainer gives the simulator up at the next fault, and the run may end. Above 0.7 an alert "
            "fires: find the cause of the faults."
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
            "Unrequested exits since the sidecar began. signal: the process was killed, perhaps for "
            "its memory; code: it exited by itself, and its log has the reason."
        ),
        unit=units.Short,
        least=0,
        width=12,
        queries=(Query(total("simulator, kind", exits) + " > 0", "{{simulator}} {{kind}}"),),
    )


def _starts() -> Panel:
    return Panel(
        question="How often were they started?",
        says=(
            "Starts since the sidecar began; the first start counts as 1. It rises with every restart, "
            "requested or not."
        ),
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
            "Simulated seconds for each second of stepping. If it is below 1 for long, an alert "
            "fires: give the simulator more CPU, a simpler world or a longer basicTimeStep. There is "
            "no value while the simulator is not stepped."
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
            "One environment step of one simulator: the median and the slowest of a hundred. If one "
            "simulator is above the others, all wait for it: restart it, or look at its node."
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
        says=(
            "Steps, counted by their duration. If there is a second band far above the first, some steps "
            "stall."
        ),
        unit=units.Seconds,
        look=Look.SPREAD,
        queries=(Query(total("le", grown(steps)), "{{le}}"),),
    )


def _slow() -> Panel:
    slow = rate(of_run("palaestra_simulator_faults_total", 'kind="slow"'))
    return Panel(
        question="How many steps are slow?",
        says=(
            "Steps in a minute that took ten times as long as the simulator's other steps, and more "
            "than 50 ms. They break nothing. If they come at regular intervals, another program runs "
            "on the node, or the simulator writes to a slow disk."
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
            "Seconds that all simulators together simulate in a second of the run, learning and saving "
            "included. This is what the run gets from its cores: compare it before and after a "
            "change of the job."
        ),
        unit=units.Short,
        least=0,
        queries=(Query(total("namespace, training_job, replica", simulated), RUN),),
    )


def _resets() -> Panel:
    return Panel(
        question="How many episodes begin?",
        says=(
            "Resets a second, in training and evaluation. A simulator without resets is not used: see "
            "its state. If there are many more than before, episodes end early."
        ),
        unit=units.OpsPerSecond,
        least=0,
        queries=(Query(rate(of_run("palaestra_simulator_resets_total")), _ONE),),
    )


def _memory() -> Panel:
    return Panel(
        question="Does its memory grow?",
        says=(
            "Memory of all processes of a simulator. If it rises with every reset, the simulator "
            "leaks: set `recycle` (aboveMemory, afterResets), which restarts it between episodes at "
            "no cost."
        ),
        unit=units.BytesIEC,
        least=0,
        width=12,
        queries=(Query(of_run("palaestra_simulator_rss_bytes"), f"{_ONE} {{{{slot}}}}"),),
    )


def _cores() -> Panel:
    return Panel(
        question="How many cores does it use?",
        says=(
            "CPU of all processes of a simulator. If it is at the limit of its resources, the simulator "
            "is throttled: raise the limit."
        ),
        unit=units.Short,
        least=0,
        width=12,
        queries=(Query(rate(of_run("palaestra_simulator_cpu_seconds_total")), f"{_ONE} {{{{slot}}}}"),),
    )
