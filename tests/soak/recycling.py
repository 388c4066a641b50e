"""A run of 2,500 episodes without supervision, with a simulator that a bus error ends after 24 resets.

The cost of recycling is the ratio of two times: the time of this run, and the time of a run without faults.
Both runs have the same seed and steps, episodes of 40 steps, and steps of 3 ms.
"""

import time

from tests.local_run import running
from tests.soak.jobs import LITTLE_DQN, tiny_job

EPISODES = 2500
STEPS_AN_EPISODE = 40
RESETS = 24
DIES = f"crash:signal=SIGBUS,reset={RESETS + 1}"
STEP_MS = 3
# A robot that turns on the spot never ends an episode early, so every episode has 40 steps.
TASK = {
    "id": "MoveToTargetEnv-v0",
    "options": {"max_steps": STEPS_AN_EPISODE, "movements": ["STOP", "TURN_LEFT", "TURN_RIGHT"]},
}
LONGEST_S = 3600.0


def measure(scale):
    """Return the times of all runs, and the ratio of the undisturbed time to each other time."""
    episodes = max(round(EPISODES * scale), 3 * RESETS)
    undisturbed = play(episodes, {"recycle": {"afterResets": 0}})
    recycled = play(episodes, {"recycle": {"afterResets": RESETS}}, DIES)
    swapped = play(episodes, {"recycle": {"afterResets": RESETS}, "standby": True}, DIES)
    with_standby = undisturbed["seconds"] / swapped["seconds"]
    return {
        "episodes": episodes,
        "undisturbed": undisturbed,
        "recycled": recycled,
        "recycled_with_standby": swapped,
        "share": round(undisturbed["seconds"] / recycled["seconds"], 3),
        "share_with_standby": round(with_standby, 3),
        "claims": {
            "all episodes were played": {it["steps"] for it in (undisturbed, recycled, swapped)}
            == {episodes * STEPS_AN_EPISODE},
            "no fault reached the learner": recycled["faults"] == swapped["faults"] == 0,
            "0.9 of the undisturbed speed with a standby": with_standby >= 0.9,
        },
    }


def play(episodes, collect, faults=""):
    """Return the duration and the summary of a complete `palaestra run`."""
    job = tiny_job(
        collect={"options": [f"--step-sleep-ms={STEP_MS}"]} | collect,
        faults=faults,
        environment=TASK,
        algorithm=LITTLE_DQN,
        steps=episodes * STEPS_AN_EPISODE,
        evaluation={"everySteps": 0},
        checkpoint={"everySteps": 10_000, "keep": 2},
    )
    started = time.monotonic()
    with running(job) as run:
        code, output = run.end(LONGEST_S)
        seconds = time.monotonic() - started
        if code:
            raise AssertionError(output)
        told = run.summary()
    return {"seconds": round(seconds, 1)} | {name: told[name] for name in ("steps", "faults", "recycled")}
