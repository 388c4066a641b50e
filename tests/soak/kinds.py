"""Short runs of two algorithms with every kind of fault end as docs/explain/reliability.md promises."""

import re

from tests.local_run import ROOT, running
from tests.soak.jobs import ANY_NUMBER, LITTLE_DQN, LITTLE_PPO, tiny_job

PAGE = ROOT / "docs/explain/reliability.md"
ROW = re.compile(
    r"^\| [^|`]+ \| `(?P<fault>[^`]+)` \| (?P<reported>\w+) \|.*\| (?P<ending>\w+) \|$", re.MULTILINE
)
ALGORITHMS = (LITTLE_DQN, LITTLE_PPO)
FAULT_KINDS = {"dead", "hung", "wrong_data"}
EXIT_CODES = {"Succeeded": 0, "SimulatorBudgetSpent": 80}
# STEPS is a multiple of PPO's rollout. The episodes are so short that more than 25 resets lie between two
# restarts.
STEPS = 96
EPISODE = {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 3}}
A_FEW = {"limit": 2, "withinSeconds": 600}  # so that a simulator that always fails ends the run soon
LONGEST_S = 600.0


def rows():
    """Return the rows of the page's table that a stub can cause: fault, reported fault, end of the run."""
    return [match.groups() for match in ROW.finditer(PAGE.read_text())]


def measure(scale):
    """Return the number of runs, and the runs that end otherwise than the table says."""
    table = rows()
    chosen = table[:: max(round(1 / scale), 1)]
    runs = [
        (fault, algorithm["name"], ending, reported, play(fault, algorithm, ending))
        for fault, reported, ending in chosen
        for algorithm in ALGORITHMS
    ]
    wrong = [
        f"{fault} {algorithm}: {found}"
        for fault, algorithm, ending, reported, found in runs
        if not is_as_told(found, ending, reported)
    ]
    return {
        "faults": len(chosen),
        "runs": len(runs),
        "not_as_told": wrong,
        "claims": {"every run ended as docs/explain/reliability.md says": not wrong},
    }


def play(fault, algorithm, ending):
    """Return exit code, number of faults by kind, and number of slow steps of a short run with a fault."""
    with running(job(fault, algorithm, ending)) as run:
        code, _ = run.end(LONGEST_S)
        slow = run.counters().get("faults", {}).get("slow", 0)
        return {"exit": code, "faults": run.faults(), "slow": slow}


def is_as_told(found, ending, reported):
    """Return whether a run ended as its row of the table says, and all its faults are of the row's kind.

    Slow steps are allowed in every run, because any step may be slow on a busy machine.
    """
    kinds = {reported} if reported in FAULT_KINDS else set()
    noticed = set(found["faults"]) == kinds and (reported != "slow" or found["slow"] > 0)
    return noticed and found["exit"] == EXIT_CODES[ending]


def job(fault, algorithm, ending):
    """Return a job in which the simulators of both groups have the same fault."""
    care = {"recycle": {"afterResets": 0}, "restart": ANY_NUMBER if ending == "Succeeded" else A_FEW}
    return tiny_job(
        faults=fault,
        collect=care,
        evaluate=care,
        environment=EPISODE,
        algorithm=algorithm,
        steps=STEPS,
        evaluation={"everySteps": STEPS // 2, "episodes": 2, "confirmEpisodes": 10},
        checkpoint={"everySteps": STEPS // 2, "keep": 2},
    )
