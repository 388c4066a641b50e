"""Every kind of fault in short runs of two algorithms: each run ends as docs/explain/reliability.md says."""

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
# The steps are a multiple of PPO's rollout. The episodes are so short that there are more than 25 resets
# between two restarts.
STEPS = 96
EPISODE = {"id": "MoveToTargetEnv-v0", "options": {"max_steps": 3}}
A_FEW = {"limit": 2, "withinSeconds": 600}  # for a simulator that fails after every restart
LONGEST_S = 600.0


def rows():
    """Return the lines of the table that a stub can cause: fault, Palaestra's report, end of the run."""
    return [match.groups() for match in ROW.finditer(PAGE.read_text())]


def measure(scale):
    """Return the end of the run with each fault, and the ends that differ from the table."""
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
    """Return exit code, faults by kind and slow steps of a short run with a fault."""
    with running(job(fault, algorithm, ending)) as run:
        code, _ = run.end(LONGEST_S)
        slow = run.counters().get("faults", {}).get("slow", 0)
        return {"exit": code, "faults": run.faults(), "slow": slow}


def is_as_told(found, ending, reported):
    """Return whether a run ended as its line of the table says, with faults of that kind and no others.

    On a busy machine any step may be slow.
    """
    kinds = {reported} if reported in FAULT_KINDS else set()
    noticed = set(found["faults"]) == kinds and (reported != "slow" or found["slow"] > 0)
    return noticed and found["exit"] == EXIT_CODES[ending]


def job(fault, algorithm, ending):
    """Return the job whose collecting and evaluating simulators have the same fault."""
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
