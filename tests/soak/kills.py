"""The trainer is killed or terminated at random times, and the run must always resume."""

import random
import re
import signal
import time

from tests.local_run import is_running, running, send
from tests.soak.jobs import LITTLE_DQN, tiny_job

TIMES = 50
SEED = 5
CHECKPOINT_STEPS = 200
# The time since the start of an attempt; simulators need a second or two to start.
MOMENT_S = (0.0, 8.0)
SAVING_S = (0.0, 0.005)  # the time since the folder of an incomplete checkpoint appeared
GRACE_S = 60.0
IN_TIME_S = GRACE_S / 2  # the half of the grace period in which the checkpoint is saved
RESUMED = re.compile(r"resumed at step (\d+)")
ENDED = re.compile(r"trainer ended with exit code (\d+)")


def measure(scale):
    """Return how many killed trainers resumed, and how many terminated trainers saved in time."""
    times = max(round(TIMES * scale), 2)
    killed = resumptions_after_kills(times)
    asked = ends_after_sigterm(times)
    in_time = [it for it in asked if is_in_time(it)]
    return {
        "killed": len(killed),
        "killed_while_saving": sum(it["while_saving"] for it in killed),
        "resumed": sum(it["resumed"] for it in killed),
        "asked_to_end": len(asked),
        "saved_in_time": len(in_time),
        "longest_s": round(max(it["seconds"] for it in asked), 1),
        "not_in_time": [it for it in asked if it not in in_time],
        "claims": {
            "all resumed after SIGKILL": all(it["resumed"] for it in killed),
            "all saved and ended with 75 after SIGTERM": len(in_time) == len(asked),
        },
    }


def job():
    """Return an endless job that often evaluates and saves."""
    return tiny_job(
        algorithm=LITTLE_DQN,
        steps=1_000_000,
        evaluation={"everySteps": 500, "episodes": 2, "confirmEpisodes": 2},
        checkpoint={"everySteps": CHECKPOINT_STEPS, "keep": 3},
    )


def resumptions_after_kills(times):
    """Kill the trainer several times, every second time while it saves, and return the results."""
    moments = random.Random(SEED)
    with running(job()) as run:
        run.until(run.checkpoints)
        found = []
        for number in range(times):
            while_saving = kill(run, moments, while_saving=number % 2 == 1)
            found.append({"while_saving": while_saving, "resumed": resumes(run)})
        goes_further(run)
    return found


def kill(run, moments, *, while_saving):
    """Kill the trainer at a random time, and return whether it was saving."""
    trainer = run.trainer()
    if while_saving:
        goes_further(run)
        run.until(lambda: drafts(run), look_every_s=0)
        time.sleep(moments.uniform(*SAVING_S))
    else:
        time.sleep(moments.uniform(*MOMENT_S))
    send(trainer, signal.SIGKILL)
    run.until(lambda: not is_running(trainer))
    return bool(drafts(run))


def resumes(run):
    """Start the run again, and return whether it continues from the newest checkpoint."""
    newest = int(run.checkpoints()[-1].name)
    run.stop()  # a running runner delays each further pod that fails without progress
    attempts = len(run.attempts())
    run.start()
    run.until(lambda: len(run.attempts()) > attempts)
    return run.attempts()[-1] == f"resumed at step {newest}"


def goes_further(run):
    """Wait until the attempt is past the step at which it began."""
    run.wait_for_step(resumed_at(run) + 1)


def drafts(run):
    """Return the folders of checkpoints that are not complete yet."""
    return list((run.directory / "checkpoints").glob(".*.draft"))


def ends_after_sigterm(times):
    """Send SIGTERM several times, every fifth time during a hung call, and return the results."""
    moments = random.Random(SEED)
    with running(job()) as run:
        run.wait_for_step(CHECKPOINT_STEPS)
        return [end(run, moments, hung=number % 5 == 4) for number in range(times)]


def end(run, moments, *, hung):
    """Send SIGTERM to the trainer at a random time.

    Returns:
        The exit code, the seconds until the end, and the number of lost steps.
    """
    trainer = run.trainer()
    time.sleep(moments.uniform(*MOMENT_S))
    if hung:
        goes_further(run)
        send(run.pid_of("palaestra-stub", "collect-0"), signal.SIGSTOP)
    before = run.status()
    ends, attempts = len(ENDED.findall(run.output())), len(run.attempts())
    began = time.monotonic()
    send(trainer, signal.SIGTERM)
    run.until(lambda: not is_running(trainer))
    seconds = time.monotonic() - began
    code = int(run.until(lambda: ENDED.findall(run.output())[ends:])[0])
    run.until(lambda: len(run.attempts()) > attempts)
    step = before["step"] if before else 0
    # The trainer repeats an unfinished rollout, which is four steps with this algorithm.
    lost = max(step - resumed_at(run) - 4, 0)
    return {"exit": code, "seconds": round(seconds, 2), "lost": lost, "hung": hung}


def is_in_time(ended):
    """Return whether a terminated trainer ended in time without loss of a step."""
    return ended["exit"] == 75 and ended["seconds"] <= IN_TIME_S and ended["lost"] == 0


def resumed_at(run):
    """Return the step at which the newest attempt began."""
    found = RESUMED.fullmatch(run.attempts()[-1])
    return int(found[1]) if found else 0
