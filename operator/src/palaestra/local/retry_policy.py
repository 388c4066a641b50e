"""The Job controller of this machine: after the end of a pod, decide whether the replica gets another pod.

`verdict` applies the planned Job's podFailurePolicy as Kubernetes does. The first matching rule decides, and
a failure without a matching rule counts against `backoffLimit`. Kubernetes has no limit for ignored failures.
Here, as in the operator, ignored failures without progress have a limit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

# After this number of consecutive pods without progress, even an ignored failure fails the replica.
IDLE_PODS = 5
# The first wait before the next pod; the wait doubles as in Kubernetes, where it starts at 10 s.
FIRST_WAIT_S = 1.0
MOST_WAIT_S = 60.0


class RetryVerdict(Enum):
    """The consequence of one pod's end."""

    COMPLETE = "complete"
    FAIL_JOB = "fail"
    IGNORE = "ignore"
    COUNT = "count"


def verdict(job: Mapping[str, Any], exit_code: int) -> RetryVerdict:
    """Return the consequence of the trainer's exit code by the rules of `job`, a batch/v1 Job."""
    if exit_code == 0:
        return RetryVerdict.COMPLETE
    for rule in job["spec"].get("podFailurePolicy", {}).get("rules", ()):
        if (codes := rule.get("onExitCodes")) and _matches(codes, exit_code):
            return {"FailJob": RetryVerdict.FAIL_JOB, "Ignore": RetryVerdict.IGNORE}.get(
                rule["action"], RetryVerdict.COUNT
            )
    return RetryVerdict.COUNT


def _matches(codes: Mapping[str, Any], exit_code: int) -> bool:
    listed = exit_code in codes["values"]
    return listed if codes["operator"] == "In" else not listed


@dataclass(slots=True, kw_only=True)
class Tries:
    """The counts of one replica's pods since the start of the runner."""

    limit: int
    counted: int = 0
    idle: int = 0
    step: int = 0

    def another(self, meaning: RetryVerdict, step: int) -> bool:
        """Record the end of a pod that reached `step`; return whether the replica gets another pod."""
        self.idle = 0 if step > self.step else self.idle + 1
        self.step = max(step, self.step)
        match meaning:
            case RetryVerdict.COUNT:
                self.counted += 1
                return self.counted <= self.limit
            case RetryVerdict.IGNORE:
                return self.idle < IDLE_PODS
            case _:
                return False

    @property
    def wait_s(self) -> float:
        """Return the seconds to wait before the next pod; they double with each pod without progress."""
        return float(min(FIRST_WAIT_S * 2 ** max(self.idle - 1, 0), MOST_WAIT_S))
