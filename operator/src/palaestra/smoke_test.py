"""Test an installation: run a TrainingJob, and always delete it afterwards.

`helm test` runs this test in a pod that may only create, read and delete TrainingJobs. So the test polls the
job and does not watch it.
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

# If the smoke test is killed, these two limits end its job and delete it later. The time until the deletion
# is long enough for people to read the result.
SLACK_S = 60
TTL_S = 3600

Report = Callable[[str], None]


class TrialFailed(PalaestraError):
    """The job did not succeed in time; the message contains the newest message in the job's status."""


def attempt(api: Api, job: Object, *, within_s: float, report: Report) -> None:
    """Create a job with a unique name, wait until it has succeeded, and delete it.

    Args:
        api: the cluster.
        job: the TrainingJob; the API server adds five characters to its name, so that two tests never have
            the same name.
        within_s: seconds within which the job must succeed.
        report: called with a line for each new phase of the job, and for each new waiting reason of a
            replica.

    Raises:
        TrialFailed: the job failed, or did not end in time.
        ApiError: the API server refused a request.
    """
    made = api.create(TRAINING_JOBS, _passing(job, within_s))["metadata"]
    succeeded = False
    try:
        _wait(api, made["namespace"], made["name"], within_s, report)
        succeeded = True
    finally:
        _take_away(api, made, report, or_fail=succeeded)


def _passing(job: Object, within_s: float) -> Object:
    """Return the job without a name; the test's limits and storage replace only absent values."""
    metadata = {**job["metadata"], "generateName": f"{job['metadata']['name']}-"}
    del metadata["name"]
    ends = {"activeDeadlineSeconds": math.ceil(within_s) + SLACK_S, "ttlSecondsAfterFinished": TTL_S}
    spec = {**ends, **job["spec"], "storage": _passing_storage(job["spec"].get("storage", {}))}
    return {**job, "metadata": metadata, "spec": spec}


def _passing_storage(storage: Object) -> Object:
    """Return the storage with claims that are deleted with the job; an existing claim stays."""
    if storage.get("existingClaim") is not None:
        return storage
    return {"retain": Retain.DELETE.value, **storage}


def _take_away(api: Api, made: Object, report: Report, *, or_fail: bool) -> None:
    """Delete the job, and report an error of the deletion.

    With `or_fail`, the error is raised if a retry cannot help. `or_fail` is for a successful job. After a
    failed job, the error of the job must be shown instead.
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
    """Return the job's status; None if the request failed and can be retried."""
    try:
        return api.get(TRAINING_JOBS, namespace, name).get("status")
    except ApiError as error:
        if not error.retryable:
            raise
        report(f"{namespace}/{name}: {error}; retrying")
        return None


def _readable(status: Object) -> Status:
    """Return the parsed status; an empty status if this release cannot read the status of another release."""
    try:
        return Status.model_validate(status)
    except ValidationError:
        return Status()


def _why(status: Object) -> str:
    """Return reason and message of the condition that has the job's whole message."""
    conditions = {condition["type"]: condition for condition in status.get("conditions", ())}
    if not conditions:
        return "no operator has reconciled it; check that the operator runs and watches this namespace"
    accepted = conditions.get("Accepted", {}).get("status") != "False"
    subject = conditions.get(status.get("phase")) or conditions.get("Running" if accepted else "Accepted")
    return f"{subject['reason']}: {subject['message']}" if subject else ""
