"""Copy a run's results out of its volume, through the running pod or through a temporary pod.

The target folder is either complete or absent. The files are written to a temporary folder next to it, which
is renamed at the end. docs/decisions/0011 explains why a command in a container sends the files.
"""

import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from palaestra.api import TrainingJob
from palaestra.api.status import Phase
from palaestra.client.errors import ClientError, NotFetched, TookTooLong
from palaestra.client.tar_extraction import WrongArchive, unpack
from palaestra.client.volume_reader_pod import CONTAINER, reading_pod, run_directory
from palaestra.client.watch import changes
from palaestra.cluster import Api, ApiError, CommandFailed, NotFound, Unreachable
from palaestra.cluster.resources import JOBS, PODS
from palaestra.objects import Object
from palaestra.plan.replica import TRAINER
from palaestra.plan.resources import in_bytes
from palaestra_protocol.temporary_folder import temporary_folder

PARTS = (
    "training.yaml",
    "hyperparameters.json",
    "model.zip",
    "evaluations.jsonl",
    "confirmations.jsonl",
    "faults.jsonl",
    "replays.json",
    "end.json",
    "report.html",
    "summary.json",
    "attempts.jsonl",
    "tensorboard",
)
# Limit of the files, as a multiple of the requested size. A volume may be larger than its request, because
# provisioners round up, and some provisioners do not limit a volume.
TIMES = 4
OF_EXISTING_BYTES = 2**34
# A replica in these phases gets a new pod if it has no pod.
GOES_ON = frozenset({Phase.PENDING, Phase.RUNNING})


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSource:
    """A container in which a run directory is mounted."""

    namespace: str
    pod: str
    container: str
    directory: str


def fetch(
    api: Api, job: TrainingJob, replica: int, into: Path, *, deadline: float, most_bytes: int | None = None
) -> Path:
    """Return the new folder `into/<job>/<replica>`: policy, report and TensorBoard data of a run.

    Args:
        api: the connection to the cluster.
        job: the job whose run is fetched.
        replica: the number of the run's replica, from 0.
        into: the folder for results.
        deadline: the time on the monotonic clock by which the call must have ended.
        most_bytes: the greatest size of all files together, in bytes; None: `TIMES` times the volume that the
            job requests, or `OF_EXISTING_BYTES` if the claim existed before.

    Raises:
        NotFetched: the folder exists already, the run does not exist, or folder or run cannot be accessed.
        TookTooLong: the deadline passed.
        ApiError: the API server refuses.
    """
    target = into / job.metadata.name / str(replica)
    if target.exists():
        raise NotFetched(f"{target}: already exists; move it away, or choose another folder")
    with _source(api, job, replica, deadline) as source, _with_remedies(source, target, deadline):
        _copy(api, source, target, deadline, most_bytes or _usual_bytes(job))
    return target


def _usual_bytes(job: TrainingJob) -> int:
    """Return the default limit for the files of a run; the size of an existing claim is not known."""
    storage = job.spec.storage
    return TIMES * in_bytes(storage.size) if storage.existing_claim is None else OF_EXISTING_BYTES


@contextmanager
def _with_remedies(source: RunSource, target: Path, deadline: float) -> Iterator[None]:
    """Replace errors in the block by errors that name the pod or folder and the remedy."""
    try:
        yield
    except Unreachable as error:
        if time.monotonic() < deadline:
            raise
        raise TookTooLong(
            f"{source.directory} in pod {source.pod}: was not copied in time; allow more time with --timeout"
        ) from error
    except (ApiError, ClientError):  # some are OSErrors too, but not about the folder
        raise
    except CommandFailed as error:
        raise NotFetched(
            f"{source.directory} in pod {source.pod}: cannot be read ({error}); "
            "run the same command again when the training has ended"
        ) from error
    except WrongArchive as error:
        raise NotFetched(
            f"{source.directory} in pod {source.pod}: was not copied, because {error}; no file was "
            "written; inspect the run; if its files are good but large, raise --max-size"
        ) from error
    except OSError as error:
        raise NotFetched(f"{target}: {error}; choose a writable folder") from error


def _copy(api: Api, source: RunSource, target: Path, deadline: float, most_bytes: int) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    program = files("palaestra.client").joinpath("tar_stream.py").read_text(encoding="utf-8")
    command = ["python3", "-I", "-c", program, source.directory, *PARTS]
    chunks = api.execute(
        source.namespace, source.pod, source.container, command, within_s=deadline - time.monotonic()
    )
    with temporary_folder(".fetch-", target.parent) as beside:
        partial = beside.path / "run"
        partial.mkdir()
        unpack(chunks, partial, PARTS, most_bytes)
        if not any(partial.iterdir()):
            raise NotFetched(
                f"{source.directory} in pod {source.pod}: is still empty; "
                "try again after the first evaluation"
            )
        partial.rename(target)


@contextmanager
def _source(api: Api, job: TrainingJob, replica: int, deadline: float) -> Iterator[RunSource]:
    """Yield a container with the run mounted: the running trainer, or a container of a temporary pod."""
    template = _template(api, job, replica)
    directory = run_directory(template)
    running = _running(api, job, replica)
    if running is not None:
        yield RunSource(namespace=job.metadata.namespace, pod=running, container=TRAINER, directory=directory)
        return
    if job.spec.storage.ephemeral:
        raise NotFetched(
            f"job {job.metadata.name}: spec.storage.ephemeral: the run was deleted with its pod; "
            "fetch while the job runs, or create the next job without this field"
        )
    with _reader(api, job, replica, template, deadline) as pod:
        yield RunSource(namespace=job.metadata.namespace, pod=pod, container=CONTAINER, directory=directory)


def _template(api: Api, job: TrainingJob, replica: int) -> Object:
    name = f"{job.metadata.name}-{replica}"
    try:
        template: Object = api.get(JOBS, job.metadata.namespace, name)["spec"]["template"]
    except NotFound:
        raise NotFetched(
            f"job {job.metadata.name}: replica {replica} was not created, so it has no run; "
            f"the job has {job.spec.replicas} replicas, and `palaestra describe` shows why a replica waits"
        ) from None
    return template


def _running(api: Api, job: TrainingJob, replica: int) -> str | None:
    """Return the name of the replica's pod if it runs; None if it has ended.

    Raises:
        NotFetched: the pod is about to start and needs its volume, or has just ended its training.
    """
    known = next((reported for reported in job.status.replicas if reported.index == replica), None)
    name = known.pod.name if known is not None and known.pod is not None else None
    status = _status(api, job.metadata.namespace, name) if name is not None else {}
    phase = status.get("phase")
    if phase == "Pending":
        raise NotFetched(
            f"pod {name}: is about to start, and no other pod may use its volume; "
            "run the same command again when the pod runs"
        )
    if phase == "Running" and _trainer_ended(status):  # the pod is still stopping its simulators
        raise NotFetched(f"pod {name}: its trainer has just ended; run the same command again in a minute")
    if phase == "Running":
        return name
    if phase != "Succeeded" and known is not None and known.phase in GOES_ON:
        again = " again" if name is not None else ""
        raise NotFetched(
            f"job {job.metadata.name}: replica {replica} is about to be started{again}, and no other pod may "
            "use its volume; run the same command again when the replica runs"
        )
    return None


def _status(api: Api, namespace: str, name: str) -> Object:
    """Return the status of a pod; an empty status if the pod does not exist."""
    try:
        status: Object = api.get(PODS, namespace, name)["status"]
    except NotFound:
        return {}
    return status


def _trainer_ended(status: Object) -> bool:
    containers = status.get("containerStatuses", ())
    return any(
        container["name"] == TRAINER and "terminated" in (container.get("state") or {})
        for container in containers
    )


@contextmanager
def _reader(api: Api, job: TrainingJob, replica: int, template: Object, deadline: float) -> Iterator[str]:
    """Yield the name of a temporary pod that mounts the volume, and always delete this pod afterwards.

    An error of the deletion is ignored, because the pod has a deadline of its own.
    """
    name = f"{job.metadata.name}-{replica}-fetch-{secrets.token_hex(3)}"
    lives_s = max(round(deadline - time.monotonic()), 1)
    made = api.create(PODS, reading_pod(job, template, name, lives_s))
    try:
        _await(api, made, deadline)
        yield name
    finally:
        with suppress(ApiError):
            api.delete(PODS, job.metadata.namespace, name, uid=made["metadata"]["uid"])


def _await(api: Api, pod: Object, deadline: float) -> None:
    """Wait until a pod runs."""
    namespace, name = pod["metadata"]["namespace"], pod["metadata"]["name"]
    why = ""
    try:
        for change in changes(api, PODS, namespace, name, deadline=deadline):
            phase = change["status"].get("phase")
            if phase == "Running":
                return
            if phase in {"Succeeded", "Failed"}:
                break
            why = blocking_reason(change) or why
    except TookTooLong:
        raise TookTooLong(
            f"pod {name}: did not start in time ({why or 'no reason reported'}); "
            "fix the cause, or allow more time with --timeout"
        ) from None
    raise NotFetched(
        f"pod {name}: was deleted or ended before the run was copied; run the same command again"
    )


def blocking_reason(pod: Object) -> str:
    """Return the cluster's reason for which a pod does not run; empty if the pod's status has no reason."""
    status = pod["status"]
    waiting = [
        (container.get("state") or {}).get("waiting") for container in status.get("containerStatuses", ())
    ]
    unmet = [condition for condition in status.get("conditions", ()) if condition.get("status") == "False"]
    reports = [report for report in (*waiting, *unmet) if report and report.get("message")]
    return f"{reports[0].get('reason')}: {reports[0]['message']}" if reports else ""
