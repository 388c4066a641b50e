"""Test an installation: run a TrainingJob, and delete it, whether it succeeds or not.

`helm test` runs this in a pod that may only create, read and delete TrainingJobs, so it polls instead of
watching.
"""

import math
import time
from collections.abc import Callable

from pydantic import ValidationError

from palaestra.api import Status
from palaestra.api.status import TERMINAL, Phase
from palaestra.api.storage import Retain
from palaestra.client.wait_progress import News
from palaestra.cluster import Api, ApiError, NotFound
from palaestra.cluster.resources import TRAINING_JOBS
from palaestra.errors import PalaestraError
from palaestra.objects import Object

PERIOD_S = 2.0

# If a trial is killed, the cluster ends and deletes its job by these limits, long after people have looked.
SLACK_S = 60
TTL_S = 3600

Report = Callable[[str], None]


class TrialFailed(PalaestraError):
    """The job did not succeed in time; the message is the newest in its status."""


def attempt(api: Api, job: Object, *, within_s: float, report: Report) -> None:
    """Create a job under a name of its own, wait until it has succeeded, and delete it.

    Args:
        api: the cluster.
        job: the TrainingJob; the API server adds five characters to its name, so that two trials never meet.
        within_s: seconds in which it has to succeed.
        report: is called with a line for each phase that the job comes to, and for each reason why a
            replica waits.

    Raises:
        TrialFailed: it failed, or had not ended in time.
        ApiError: the API server refused something.
    """
    made = api.create(TRAINING_JOBS, _passing(job, within_s))["metadata"]
    succeeded = False
    try:
        _wait(api, made["namespace"], made["name"], within_s, report)
        succeeded = True
    finally:
        _take_away(api, made, report, or_fail=succeeded)


def _passing(job: Object, within_s: float) -> Object:
    """Return the job without a name; its author's ends and `retain` stay, what is not set is made to pass."""
    metadata = {**job["metadata"], "generateName": f"{job['metadata']['name']}-"}
    del metadata["name"]
    ends = {"activeDeadlineSeconds": math.ceil(within_s) + SLACK_S, "ttlSecondsAfterFinished": TTL_S}
    spec = {**ends, **job["spec"], "storage": _passing_storage(job["spec"].get("storage", {}))}
    return {**job, "metadata": metadata, "spec": spec}


def _passing_storage(storage: Object) -> Object:
    """Return the storage with claims that are deleted with the job; an existing claim is never deleted."""
    if storage.get("existingClaim") is not None:
        return storage
    return {"retain": Retain.DELETE.value, **storage}


def _take_away(api: Api, made: Object, report: Report, *, or_fail: bool) -> None:
    """Delete the job. If that fails, report it by `report`, or with `or_fail` raise an error.

    `or_fail` is for successful trials: the error of a failed trial must stay the one that is shown.
    """
    namespace, name = made["namespace"], made["name"]
    try:
        api.delete(TRAINING_JOBS, namespace, name, uid=made["uid"])
    except NotFound:
        pass
    except ApiError as error:
        if or_fail and not error.retryable:
            raise
        remedy = f"delete it by hand: `kubectl delete trainingjob -n {namespace} {name}`"
        report(f"{namespace}/{name}: could not be deleted ({error}); {remedy}")


def _wait(api: Api, namespace: str, name: str, within_s: float, report: Report) -> None:
    ends = time.monotonic() + within_s
    status: Object = {}
    phase, news = "", News(f"{namespace}/{name}")
    while phase not in TERMINAL:
        if time.monotonic() > ends:
            raise TrialFailed(f"{namespace}/{name}: {phase} after {within_s:g} s; {_why(status)}")
        if phase:
            time.sleep(PERIOD_S)
        status = _status(api, namespace, name, report) or status
        phase = status.get("phase", Phase.PENDING.value)
        for line in news.of(phase, _readable(status)):
            report(line)
    if phase != Phase.SUCCEEDED.value:
        raise TrialFailed(f"{namespace}/{name}: {phase}; {_why(status)}")


def _status(api: Api, namespace: str, name: str, report: Report) -> Object | None:
    """Return the job's status; None while the API server has no answer."""
    try:
        return api.get(TRAINING_JOBS, namespace, name).get("status")
    except ApiError as error:
        if not error.retryable:
            raise
        report(f"{namespace}/{name}: {error}; asked again")
        return None


def _readable(status: Object) -> Status:
    """Return the status as this release reads it; empty where another release has written another."""
    try:
        return Status.model_validate(status)
    except ValidationError:
        return Status()


def _why(status: Object) -> str:
    """Return reason and message of the condition that is the subject of the status."""
    conditions = {condition["type"]: condition for condition in status.get("conditions", ())}
    if not conditions:
        return "nothing has looked at it: does the operator run, and does it look after this namespace?"
    accepted = conditions.get("Accepted", {}).get("status") != "False"
    subject = conditions.get(status.get("phase")) or conditions.get("Running" if accepted else "Accepted")
    return f"{subject['reason']}: {subject['message']}" if subject else ""
