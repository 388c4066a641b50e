"""The volume of a run, and the run from which it resumes."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import FOLDER, ObjectName, Quantity
from palaestra.api.model import ApiModel, Rule


class Retain(StrEnum):
    """Whether a run is kept when its TrainingJob is deleted."""

    KEEP = "Keep"
    DELETE = "Delete"


class Storage(ApiModel):
    """The volume of a replica's run directory: a new claim, an existing claim, or an ephemeral volume.

    `palaestra run` ignores these fields and keeps its runs in a folder.
    """

    size: Quantity = "1Gi"
    """Size of the claim that the operator creates for each replica; with `ephemeral`, size limit of the
    volume in the pod."""

    storage_class_name: ObjectName | None = None
    """Storage class of the claim; absent: the cluster's default."""

    retain: Retain = Field(default=Retain.KEEP, strict=False)
    """`Keep`: the claim stays when the TrainingJob is deleted, unless it was never bound to a volume.
    `Delete`: the claim is deleted too."""

    ephemeral: bool = False
    """`true` keeps the run in the pod, so the run is deleted with the pod; the condition `Accepted` reports
    this."""

    existing_claim: ObjectName | None = None
    """Claim in the job's namespace with the label `palaestra.dev/for-jobs: "true"`; absent: the operator
    creates a claim for each replica. Several replicas on one claim need access mode ReadWriteMany."""

    resume_from: Annotated[str, Field(min_length=1, max_length=63, pattern=FOLDER)] | None = None
    """Folder of another job's run on the existing claim; the name of the folder is the UID of that job. Each
    replica resumes from the newest checkpoint of the replica with the same number and trains up to its own
    `steps`. Both jobs must have the same algorithm and environment. Absent: training starts from the
    beginning."""

    rules = (
        Rule(
            field="ephemeral",
            holds=lambda storage: not (storage.ephemeral and storage.existing_claim is not None),
            cel="!(self.ephemeral && has(self.existingClaim))",
            message="cannot be combined with existingClaim; remove one of them",
        ),
        Rule(
            field="ephemeral",
            holds=lambda storage: not (storage.ephemeral and storage.storage_class_name is not None),
            cel="!(self.ephemeral && has(self.storageClassName))",
            message="cannot be combined with storageClassName, as no claim is created; remove one of them",
        ),
        Rule(
            field="storageClassName",
            holds=lambda storage: storage.storage_class_name is None or storage.existing_claim is None,
            cel="!(has(self.storageClassName) && has(self.existingClaim))",
            message="cannot be combined with existingClaim, which already has a class; remove one of them",
        ),
        Rule(
            field="retain",
            holds=lambda storage: storage.existing_claim is None or storage.retain is Retain.KEEP,
            cel="!has(self.existingClaim) || self.retain == 'Keep'",
            message="an existing claim is never deleted with the job; use Keep",
        ),
        Rule(
            field="resumeFrom",
            holds=lambda storage: storage.resume_from is None or storage.existing_claim is not None,
            cel="!has(self.resumeFrom) || has(self.existingClaim)",
            message="needs existingClaim; name the claim that contains the run",
        ),
    )
