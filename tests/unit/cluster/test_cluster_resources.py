"""Kinds of Kubernetes objects, and their URL paths at the API server."""

import pytest

from palaestra.cluster import resources
from palaestra.cluster.errors import (
    AlreadyExists,
    ApiError,
    Conflict,
    Forbidden,
    Gone,
    Invalid,
    NamespaceTerminating,
    NotFound,
    ServerError,
    TooManyRequests,
    from_status,
)


@pytest.mark.parametrize(
    ("resource", "namespace", "name", "address"),
    [
        (resources.PODS, "n", "p", "/api/v1/namespaces/n/pods/p"),
        (resources.PODS, None, None, "/api/v1/pods"),
        (resources.JOBS, "n", None, "/apis/batch/v1/namespaces/n/jobs"),
        (resources.NODES, None, "m", "/api/v1/nodes/m"),
        (resources.NODES, "n", "m", "/api/v1/nodes/m"),
        (resources.TRAINING_JOBS, "n", "t", "/apis/palaestra.dev/v1alpha1/namespaces/n/trainingjobs/t"),
    ],
)
def test_an_address_is_made_of_group_namespace_and_name(resource, namespace, name, address):
    """The paths of the core group begin with `/api`, those of other groups with `/apis`."""
    assert resource.address(namespace, name) == address


def test_a_name_cannot_lead_to_another_address():
    """Users choose the names of objects, so a name must not change the path of a request."""
    assert resources.PODS.address("n", "../secrets/x?y") == "/api/v1/namespaces/n/pods/..%2Fsecrets%2Fx%3Fy"


@pytest.mark.parametrize("resource", resources.ALL, ids=lambda resource: resource.plural)
def test_an_object_names_its_resource(resource):
    """A planned object has a kind and a version, which identify its resource."""
    assert resources.resource_of({"apiVersion": resource.api_version, "kind": resource.kind}) == resource


def test_a_kind_that_the_operator_does_not_use_is_refused_by_name():
    """The operator has no permission for such a kind, so a plan that contains it is a bug."""
    with pytest.raises(KeyError, match="apps/v1 Deployment"):
        resources.resource_of({"apiVersion": "apps/v1", "kind": "Deployment"})


@pytest.mark.parametrize(
    ("code", "reason", "error"),
    [
        (404, "NotFound", NotFound),
        (409, "AlreadyExists", AlreadyExists),
        (409, "Conflict", Conflict),
        (403, "Forbidden", Forbidden),
        (422, "Invalid", Invalid),
        (400, "BadRequest", Invalid),
        (410, "Expired", Gone),
        (410, "Gone", Gone),
        (429, "TooManyRequests", TooManyRequests),
        (503, "ServiceUnavailable", ServerError),
        (418, "", ApiError),
    ],
)
def test_each_refusal_has_its_error(code, reason, error):
    """The code 409 has two meanings, which only the reason distinguishes."""
    found = from_status(code, {"reason": reason, "message": "m"})

    assert type(found) is error
    assert (found.code, found.message) == (code, "m")


def test_a_terminating_namespace_is_distinguished_from_a_missing_right():
    """Both responses are 403 Forbidden.

    A terminating namespace needs no action, but a missing permission needs a person.
    """
    causes = [{"reason": "NamespaceTerminating", "message": "namespace lab is being terminated"}]

    found = from_status(403, {"reason": "Forbidden", "message": "m", "details": {"causes": causes}})

    assert type(found) is NamespaceTerminating
    assert not found.retryable


@pytest.mark.parametrize(
    ("header", "seconds"), [("7", 7), (None, 1), ("Wed, 21 Oct 2026 07:28:00 GMT", 1), ("-3", 0)]
)
def test_the_wait_that_a_busy_server_asks_for_is_read(header, seconds):
    """A proxy may send any value in the header `Retry-After`."""
    assert from_status(429, {}, header).retry_after_s == seconds


def test_a_status_without_anything_still_says_what_happened():
    """A proxy may respond without a Status object. The error then has only the HTTP code."""
    assert str(from_status(502, {})) == "HTTP502 (502): the API server gave no message"
