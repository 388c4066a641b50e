"""The progress of a training whose simulator is killed several times: with Palaestra and other libraries.

The measurement of one hour is compressed into 40 s, so 10 faults per hour mean one fault in 4 s. A restart
takes its real time, so it costs a 90 times larger share than in a real hour. Repeated steps count once.
"""

import tempfile
import time
from pathlib import Path

from tests.bench.peer_runs import Palaestra, Program, kill, wait_for_steps
from tests.bench.recoveries import NEVER

HOUR_S = 40.0  # the compressed hour
LEAST_S = 2.0
FAULTS = (0, 1, 5, 10)
SCALE_OF_ALL = 0.1  # below this scale, only the first two rates of FAULTS are measured
WARM_STEPS = 200
LOOK_EVERY_S = 0.05
WAYS = {
    "palaestra": Palaestra,
    "without_restarts": lambda folder: Palaestra(folder, NEVER),
    "subproc": Program,
}


def measure(scale=1.0):
    """Return the steps per second of each way of training, by the number of faults in an hour."""
    hour_s = max(HOUR_S * scale, LEAST_S)
    rates = FAULTS if scale >= SCALE_OF_ALL else FAULTS[:2]
    found = {way: {} for way in WAYS}
    for faults in rates:
        for way, make in WAYS.items():
            found[way][str(faults)] = steps_per_second(make, faults, hour_s)
    return {"hour_s": hour_s, "steps_per_second": found, "share": shares(found)}


def shares(found):
    """Return the steps of each way as a share of its steps without faults."""
    return {
        way: {faults: round(rate / rates["0"], 3) for faults, rate in rates.items()}
        for way, rates in found.items()
    }


def steps_per_second(make, faults, hour_s):
    """Return the steps per second of a training whose simulator is killed at equal intervals."""
    with tempfile.TemporaryDirectory() as folder, make(Path(folder)) as training:
        wait_for_steps(training, WARM_STEPS)
        first, began = training.steps(), time.monotonic()
        moments = [began + (number + 0.5) * hour_s / faults for number in range(faults)]
        while (now := time.monotonic()) < began + hour_s:
            if moments and now >= moments[0]:
                moments.pop(0)
                kill(training)  # no effect while the simulator is still being restarted
            training.revive()
            time.sleep(LOOK_EVERY_S)
        return round(max(training.steps() - first, 0) / hour_s, 1)
