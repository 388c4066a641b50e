"""Where a run is kept, and which run it goes on from."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import FOLDER, ObjectName, Quantity
from palaestra.api.model import ApiModel, Rule


class Retain(StrEnum):
    """What becomes of a run when its TrainingJob is deleted."""

    KEEP = "Keep"
    DELETE = "Delete"


class Storage(ApiModel):
    """The volume of a replica's run directory: a claim of its own, an existing one, or none.

    Not used by `palaestra run`, which keeps its runs in a folder.
    """

    size: Quantity = "1Gi"
    """Size of the claim made for each replica."""

    storage_class_name: ObjectName | None = None
    """Storage class of the claim; absent: the cluster's default."""

    retain: Retain = Field(default=Retain.KEEP, strict=False)
    """`Keep`: the claim outlives the TrainingJob. `Delete`: it goes with it."""

    ephemeral: bool = False
    """True: the run lies in the pod and goes with it; a condition says so."""

    existing_claim: ObjectName | None = None
    """A claim in the job's own namespace that carries the label `palaestra.dev/for-jobs: "true"`;
    absent: one is made for each replica. Several replicas on one claim need ReadWriteMany."""

    resume_from: Annotated[str, Field(min_length=1, max_length=63, pattern=FOLDER)] | None = None
    """Folder of another job's run on the existing claim, the UID of that job: each replica goes on
    from the newest checkpoint of the replica with its number, up to its own `steps`. Algorithm and
    environment must be the same. Absent: training starts anew."""

    rules = (
        Rule(
            field="ephemeral",
            holds=lambda it: not (it.ephemeral and it.existing_claim is not None),
            cel="!(self.ephemeral && has(self.existingClaim))",
            message="excludes existingClaim; remove one of them",
        ),
        Rule(
            field="ephemeral",
            holds=lambda it: not (it.ephemeral and it.storage_class_name is not None),
            cel="!(self.ephemeral && has(self.storageClassName))",
            message="excludes storageClassName, as no claim is made; remove one of them",
        ),
        Rule(
            field="storageClassName",
            holds=lambda it: it.storage_class_name is None or it.existing_claim is None,
            cel="!(has(self.storageClassName) && has(self.existingClaim))",
            message="an existing claim has its class already; remove it or existingClaim",
        ),
        Rule(
            field="retain",
            holds=lambda it: it.existing_claim is None or it.retain is Retain.KEEP,
            cel="!has(self.existingClaim) || self.retain == 'Keep'",
            message="a claim that was there before the job is never deleted with it; use Keep",
        ),
        Rule(
            field="resumeFrom",
            holds=lambda it: it.resume_from is None or it.existing_claim is not None,
            cel="!has(self.resumeFrom) || has(self.existingClaim)",
            message="needs existingClaim; name the claim that holds the run",
        ),
    )
