"""A full training and one of two replicas run at the same time as other tests; their operator is killed."""

import random
import threading
from datetime import UTC, datetime
from typing import Self

from tests.e2e.cluster import CommandFailed, Object
from tests.e2e.jobs import SMALL, tiny_job
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM, Namespace, named, trains
from tests.jobs import example

NAME, STEPS = "move-to-target", 30_000
# Its steps take time but no processor, so that it runs until the last kill on the fastest machine.
PAIR, PAIR_STEPS = "pair", 3_000
TENTH_OF_A_SECOND = [{"name": "PALAESTRA_STUB_FAULTS", "value": "slow:latency_ms=100"}]
REPLICAS = 2
KILLS = 10
SEED = 20
# The gaps between two kills alternate. One is long enough for an operator to lead again, 15 s after the last
# renewal; in the other it has only just started. Together they are shorter than the pair's training.
GAPS_S = ((26.0, 36.0), (4.0, 10.0))
END_S = 900.0
EVALUATED_EVERY = 10_000  # with more evaluations, these take a third of the training's time
# The requests are so small that other pods fit next to it and come first if processors are short.
SIMULATOR = {"requests": {"cpu": "1m", "memory": "160Mi"}}
TRAINER = {"requests": {"cpu": "1m", "memory": "768Mi"}, "limits": {"cpu": "1", "memory": "2Gi"}}

# The operator is process 1 of its container, which no signal from inside can kill unless the pod shares its
# process namespace.
SHARED = {"spec": {"template": {"spec": {"shareProcessNamespace": True}}}}
KILL = """
import os, pathlib, signal
for entry in pathlib.Path("/proc").glob("[0-9]*"):
    words = (entry / "cmdline").read_bytes().split(b"\\0") if int(entry.name) != os.getpid() else []
    if b"operator" in words:
        os.kill(int(entry.name), signal.SIGKILL)
"""


class LongRun:
    """Both jobs, their `namespace`, and `kills`, the times at which their operator was killed."""

    def __init__(self, namespace: Namespace) -> None:
        self.namespace = namespace
        self.kills: list[datetime] = []
        self._ended = threading.Event()
        self._killer = threading.Thread(target=self._kill_again_and_again, daemon=True)

    def __enter__(self) -> Self:
        """Start the trainings and the kills at the same time."""
        make_killable(self.namespace)
        self.namespace.apply(_full())
        self.namespace.apply(_pair())
        self._killer.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End both jobs."""
        self._ended.set()
        self._killer.join(END_S)
        self.namespace.delete()

    def pods(self) -> list[Object]:
        """Return the pods of the pair when both train."""
        space = self.namespace

        def training() -> list[Object]:
            found = [pod for pod in space.pods(PAIR) if trains(pod)]
            steps = [space.trainer_status(named(pod)).get("step", 0) for pod in found]
            return found if len(found) == REPLICAS and all(steps) else []

        return space.wait(training, LONG_S)

    def wait_for_kills(self) -> None:
        """Wait until the last kill of the operator."""
        self._killer.join(END_S)

    def end(self, name: str) -> Object:
        """Return the last status of one of the jobs."""
        self.namespace.wait_for_end(name, END_S)
        self.wait_for_kills()
        return self.namespace.status(name)

    def _kill_again_and_again(self) -> None:
        moments = random.Random(SEED)
        while len(self.kills) < KILLS and not self._ended.wait(moments.uniform(*self._gap_s())):
            if kill_operator(self.namespace):
                self.kills.append(datetime.now(UTC))

    def _gap_s(self) -> tuple[float, float]:
        return GAPS_S[len(self.kills) % len(GAPS_S)]


def _full() -> Object:
    job = example(NAME)
    for group in job["spec"]["simulators"]:
        group["resources"] = SIMULATOR
    job["spec"]["trainer"]["resources"] = TRAINER
    evaluation = job["spec"]["trainer"]["evaluation"]
    evaluation["everySteps"] = EVALUATED_EVERY
    del evaluation["stopAtSuccessRate"]  # the operator is killed until the last step
    return job


def _pair() -> Object:
    simulators = [
        {"name": "collect", "role": "Collect", "env": TENTH_OF_A_SECOND, "resources": SIMULATOR},
        {"name": "evaluate", "role": "Evaluate", "resources": SIMULATOR},
    ]
    trainer = {
        "steps": PAIR_STEPS,
        "evaluation": {"everySteps": PAIR_STEPS, "episodes": 1, "confirmEpisodes": 1},
        "checkpoint": {"everySteps": PAIR_STEPS},
        "resources": SMALL,
    }
    return tiny_job(PAIR, replicas=REPLICAS, simulators=simulators, trainer=trainer)


def make_killable(namespace: Namespace) -> None:
    """Prepare the operator so that a test can kill it as a node without memory does."""
    cluster = namespace.cluster
    cluster.patch("deployments", SYSTEM, OPERATOR, SHARED)
    cluster.rolled_out(SYSTEM, OPERATOR)


def operators(namespace: Namespace) -> list[Object]:
    """Return the pods of the operator's Deployment whose containers run."""
    pods = namespace.cluster.select("pods", SYSTEM, "app.kubernetes.io/component=operator")
    return [pod for pod in pods if trains(pod) and "deletionTimestamp" not in pod["metadata"]]


def kill_operator(namespace: Namespace, pod: str = "") -> bool:
    """Kill an operator with SIGKILL and replace it by a new one; return whether one existed.

    The pod is deleted too: a container that is killed often is restarted only minutes later.
    """
    chosen = pod or next((named(each) for each in operators(namespace)), "")
    if not chosen:
        return False
    try:
        namespace.cluster.execute(SYSTEM, chosen, "operator", "python3", "-c", KILL)
    except CommandFailed:  # it has already ended, or is not up yet
        return False
    namespace.cluster.delete("pods", SYSTEM, chosen, grace_s=0)
    return True
