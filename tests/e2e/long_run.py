"""A full training and a job of two replicas, which run during other tests while their operator is killed."""

import random
import threading
from datetime import UTC, datetime
from typing import Self

from tests.e2e.cluster import CommandFailed, Object
from tests.e2e.jobs import SMALL, tiny_job
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM, Namespace, named, trains
from tests.jobs import example

NAME, STEPS = "move-to-target", 25_000
# Each step of the pair waits without using the processor, so the pair trains past the last kill on any
# machine.
PAIR, PAIR_STEPS = "pair", 3_000
TENTH_OF_A_SECOND = [{"name": "PALAESTRA_STUB_FAULTS", "value": "slow:latency_ms=100"}]
REPLICAS = 2
KILLS = 10
SEED = 20
# Long and short gaps between two kills alternate. After a long gap, a new operator leads again (15 s after
# the last renewal of the lease). After a short gap, the new operator has only just started. The sum of the
# gaps is shorter than the pair's training.
GAPS_S = ((26.0, 36.0), (4.0, 10.0))
END_S = 900.0
EVALUATED_EVERY = 10_000  # more evaluations would take a third of the training's time
# The requests are small, so that other pods fit on the node and get processor time first.
SIMULATOR = {"requests": {"cpu": "1m", "memory": "160Mi"}}
TRAINER = {"requests": {"cpu": "1m", "memory": "768Mi"}, "limits": {"cpu": "1", "memory": "2Gi"}}

# The operator is process 1 of its container. The kernel lets no process of the container kill process 1,
# unless the containers of the pod share a process namespace.
SHARED = {"spec": {"template": {"spec": {"shareProcessNamespace": True}}}}
KILL = """
import os, pathlib, signal
for entry in pathlib.Path("/proc").glob("[0-9]*"):
    words = (entry / "cmdline").read_bytes().split(b"\\0") if int(entry.name) != os.getpid() else []
    if b"operator" in words:
        os.kill(int(entry.name), signal.SIGKILL)
"""


class LongRun:
    """Both jobs, their `namespace`, and `kills`, the times at which the operator was killed."""

    def __init__(self, namespace: Namespace) -> None:
        self.namespace = namespace
        self.kills: list[datetime] = []
        self._ended = threading.Event()
        self._killer = threading.Thread(target=self._kill_again_and_again, daemon=True)

    def __enter__(self) -> Self:
        """Start both trainings, and start to kill the operator."""
        make_killable(self.namespace)
        self.namespace.apply(_full())
        self.namespace.apply(_pair())
        self._killer.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the thread that kills the operator, and delete both jobs."""
        self._ended.set()
        self._killer.join(END_S)
        self.namespace.delete()

    def pods(self) -> list[Object]:
        """Wait until both replicas of the pair train, and return their pods."""
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
        """Wait for the end of a job and for the last kill, and return the job's status."""
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
    del evaluation["stopAtSuccessRate"]  # the training must reach its last step
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
    """Change the operator's Deployment so that a test can end the operator with SIGKILL."""
    cluster = namespace.cluster
    cluster.patch("deployments", SYSTEM, OPERATOR, SHARED)
    cluster.rolled_out(SYSTEM, OPERATOR)


def operators(namespace: Namespace) -> list[Object]:
    """Return the pods of the operator's Deployment whose containers run."""
    pods = namespace.cluster.select("pods", SYSTEM, "app.kubernetes.io/component=operator")
    return [pod for pod in pods if trains(pod) and "deletionTimestamp" not in pod["metadata"]]


def kill_operator(namespace: Namespace, pod: str = "") -> bool:
    """Send SIGKILL to an operator and delete its pod; return whether an operator ran.

    A new pod starts at once, but Kubernetes restarts a container that ended often only after minutes.
    """
    chosen = pod or next((named(each) for each in operators(namespace)), "")
    if not chosen:
        return False
    try:
        namespace.cluster.execute(SYSTEM, chosen, "operator", "python3", "-c", KILL)
    except CommandFailed:  # the operator has ended, or has not started yet
        return False
    namespace.cluster.delete("pods", SYSTEM, chosen, grace_s=0)
    return True
