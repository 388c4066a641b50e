"""The objects to which a job refers, each with the field of the reference."""

from palaestra.observe import ReferenceKind, references

SECRET = {"env": [{"name": "A", "secretKeyRef": {"name": "keys", "key": "a"}}]}


def test_a_job_of_defaults_refers_to_nothing(valid_job):
    """The bundled worlds are in the images, and the operator creates the claims."""
    assert references(valid_job()) == ()


def test_worlds_secrets_and_claims_are_named_with_their_fields(valid_job):
    """If an object is missing, the author must know which field refers to it."""
    job = valid_job(
        simulators=[
            {"name": "a", "role": "Collect", "world": {"configMap": {"name": "worlds", "key": "a.wbt"}}},
            {"name": "b", "role": "Evaluate", **SECRET},
        ],
        trainer={"env": [{"name": "B", "value": "1"}, *SECRET["env"]]},
        storage={"existingClaim": "runs"},
        imagePullSecrets=[{"name": "keys"}, {"name": "registry"}],
    )

    assert [(each.kind, each.name, each.field) for each in references(job)] == [
        (ReferenceKind.CONFIG_MAP, "worlds", "spec.simulators[0].world.configMap"),
        (ReferenceKind.SECRET, "keys", "spec.trainer.env[1].secretKeyRef"),
        (ReferenceKind.SECRET, "registry", "spec.imagePullSecrets[1]"),
        (ReferenceKind.CLAIM, "runs", "spec.storage.existingClaim"),
    ]


def test_an_object_that_is_named_twice_is_looked_up_once(valid_job):
    """Thirty variables from one Secret must cause only one request."""
    env = [{"name": name, "secretKeyRef": {"name": "keys", "key": name}} for name in "ABC"]

    assert len(references(valid_job(trainer={"env": env}))) == 1
