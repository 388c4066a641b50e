"""The objects to which a job refers by name; a job may use only objects with the label for jobs."""

from collections.abc import Iterator, Mapping

from palaestra.api import TrainingJob
from palaestra.api.container import Variable
from palaestra.observe.models import ReferencedObject, ReferenceKind

FOR_JOBS = "palaestra.dev/for-jobs"


def references(job: TrainingJob) -> tuple[ReferencedObject, ...]:
    """Return all objects to which the job's spec refers and that need the label for jobs, each once."""
    return tuple(dict.fromkeys((*_worlds(job), *_secrets(job), *_pull_secrets(job), *_claims(job))))


def open_to_jobs(raw: object) -> bool:
    """Return whether an object has the label that allows jobs to use it."""
    metadata = raw.get("metadata") if isinstance(raw, Mapping) else None
    labels = metadata.get("labels") if isinstance(metadata, Mapping) else None
    return isinstance(labels, Mapping) and labels.get(FOR_JOBS) == "true"


def _worlds(job: TrainingJob) -> Iterator[ReferencedObject]:
    for place, group in enumerate(job.spec.simulators):
        if (reference := group.world.config_map) is not None:
            field = f"spec.simulators[{place}].world.configMap"
            yield ReferencedObject(kind=ReferenceKind.CONFIG_MAP, name=reference.name, field=field)


def _secrets(job: TrainingJob) -> Iterator[ReferencedObject]:
    yield from _of_variables(job.spec.trainer.env, "spec.trainer")
    for place, group in enumerate(job.spec.simulators):
        yield from _of_variables(group.env, f"spec.simulators[{place}]")


def _pull_secrets(job: TrainingJob) -> Iterator[ReferencedObject]:
    for place, secret in enumerate(job.spec.image_pull_secrets):
        field = f"spec.imagePullSecrets[{place}]"
        yield ReferencedObject(kind=ReferenceKind.SECRET, name=secret.name, field=field)


def _of_variables(env: tuple[Variable, ...], owner: str) -> Iterator[ReferencedObject]:
    for place, variable in enumerate(env):
        if (reference := variable.secret_key_ref) is not None:
            field = f"{owner}.env[{place}].secretKeyRef"
            yield ReferencedObject(kind=ReferenceKind.SECRET, name=reference.name, field=field)


def _claims(job: TrainingJob) -> Iterator[ReferencedObject]:
    if (name := job.spec.storage.existing_claim) is not None:
        yield ReferencedObject(kind=ReferenceKind.CLAIM, name=name, field="spec.storage.existingClaim")
    if (initial := job.spec.trainer.initial_policy) is not None and initial.claim is not None:
        field = "spec.trainer.initialPolicy.claim"
        yield ReferencedObject(kind=ReferenceKind.CLAIM, name=initial.claim, field=field)
