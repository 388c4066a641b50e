"""`palaestra run` of a job whose simulators leave out a part of their world."""

import re

from palaestra_sim.world import builtin
from tests.local_run import running
from tests.soak.jobs import LITTLE_DQN, tiny_job

LINE = r"{0}: the stub simulates no Colosseum: 2 nodes left out \({0}-0.wbt, lines \d+, \d+\)"


def test_what_simulators_leave_out_reaches_the_person_who_reads_the_run():
    """The user sees each omission once in the output, and the trainer's /status contains it."""
    part = {
        "world": {"inline": builtin("arena").decode() + "Colosseum { }\nColosseum { }\n"},
        "options": ["--leave-out", "Colosseum"],
    }
    job = tiny_job(
        collect=part | {"count": 2, "standby": True}, evaluate=part, algorithm=LITTLE_DQN, steps=1_000_000
    )

    with running(job) as run:
        left_out = run.wait_for_step(1)["left_out"]
        run.until(lambda: "simulators leave out nodes of their world" in run.output())
        output = run.until(lambda: out if all(line in (out := run.output()) for line in left_out) else None)

    collect, evaluate = left_out
    assert re.fullmatch(LINE.format("collect"), collect)
    assert re.fullmatch(LINE.format("evaluate"), evaluate)
    assert [output.count(line) for line in left_out] == [1, 1]
