"""The CustomResourceDefinition, generated from the models.

The models define the checks of the API server. This module adds the names, the scope, the columns, the
selectable fields and the status subresource.
"""

from typing import Any

from palaestra.api.job import API_VERSION, KIND, TrainingJob
from palaestra.api.structural import Schema, freeze, structural, without_marks

GROUP, VERSION = API_VERSION.split("/")

_COLUMNS = (
    ("Status", "string", ".status.phase", "Phase of the job", 0),
    ("Reason", "string", '.status.conditions[?(@.type=="Running")].reason', "Reason for the phase", 0),
    ("Replicas", "string", ".status.running", "Replicas that run or have succeeded, of all replicas", 0),
    ("Step", "integer", ".status.step", "Step of the replica that is furthest behind", 0),
    ("Target", "integer", ".spec.trainer.steps", "Environment steps of the whole run", 0),
    ("Success", "number", ".status.successRate", "Success rate of the worst replica", 0),
    ("Algorithm", "string", ".spec.trainer.algorithm.name", "The learning algorithm", 1),
    ("Started", "date", ".status.startTime", "When the first pod started", 1),
    ("Completed", "date", ".status.completionTime", "When the last replica ended", 1),
    ("Attempt", "integer", ".status.attempt", "Highest attempt of all replicas", 1),
    (
        "Restarts",
        "integer",
        ".status.restarts",
        "Largest number of pods of one replica that were replaced because the trainer failed",
        1,
    ),
    (
        "Checkpoint",
        "date",
        ".status.lastCheckpointTime",
        "Earliest time at which a replica saved its newest checkpoint",
        1,
    ),
    ("Node", "string", ".status.nodes", "Nodes of the newest pods", 1),
    ("Age", "date", ".metadata.creationTimestamp", "When the job was created", 0),
)

_SELECTABLE = (
    ".status.phase",
    ".spec.scheduling.queueName",
)  # `--field-selector` can select jobs by these fields since Kubernetes 1.32


def crd() -> dict[str, Any]:
    """Return the CustomResourceDefinition of TrainingJobs as plain data."""
    return {
        "apiVersion": "apiextensions.k8s.io/v1",
        "kind": "CustomResourceDefinition",
        "metadata": {"name": f"trainingjobs.{GROUP}"},
        "spec": {
            "group": GROUP,
            "names": {
                "kind": KIND,
                "listKind": f"{KIND}List",
                "plural": "trainingjobs",
                "singular": "trainingjob",
                "shortNames": ["tj"],
                "categories": ["all", "palaestra"],
            },
            "scope": "Namespaced",
            "versions": [
                {
                    "name": VERSION,
                    "served": True,
                    "storage": True,
                    "subresources": {"status": {}},
                    "additionalPrinterColumns": [_column(*column) for column in _COLUMNS],
                    "selectableFields": [{"jsonPath": path} for path in _SELECTABLE],
                    "schema": {"openAPIV3Schema": schema()},
                }
            ],
        },
    }


def schema() -> Schema:
    """Return the structural schema of a TrainingJob."""
    source = TrainingJob.model_json_schema(by_alias=True)
    whole = structural(source, source["$defs"])
    fields = whole["properties"]
    freeze(fields["spec"])
    for heading in ("apiVersion", "kind"):  # the API server itself checks the values of these fields
        fields[heading] = {"type": "string", "maxLength": 63}
    # The schema of a CRD may restrict only the fields `name` and `generateName` of `metadata`.
    name = fields["metadata"]["properties"]["name"]
    fields["metadata"] = {"type": "object", "properties": {"name": name}}
    # Generations begin at 1, so 0 means "not read yet". Without this default, kstatus would report a new job
    # as reconciled before an operator has read the job.
    fields["status"]["default"] = {"observedGeneration": 0}
    _remove_empty_defaults(fields["status"])
    plain: Schema = without_marks(whole)
    return plain


def _remove_empty_defaults(schema: Schema) -> None:
    """Remove the empty defaults of lists; `kubectl describe` would print a heading for each empty list."""
    if schema.get("default") == []:
        del schema["default"]
    for inner in (*schema.get("properties", {}).values(), *([schema["items"]] if "items" in schema else ())):
        _remove_empty_defaults(inner)


def _column(name: str, kind: str, path: str, description: str, priority: int) -> dict[str, Any]:
    column = {"name": name, "type": kind, "jsonPath": path, "description": description}
    return column | ({"priority": priority} if priority else {})
