"""The HTTP port of the operator, which kubelets and Prometheus read."""

import socket
import urllib.error
import urllib.request
from importlib.metadata import version

import pytest

from palaestra.errors import PalaestraError
from palaestra.operator.health import serving
from palaestra.operator.metrics import Metrics
from palaestra.operator.options import address
from palaestra_protocol.http import Address

WAIT_S = 10.0
PHASES = [("robots", "Running"), ("robots", "Running"), ("home", "Failed")]


@pytest.fixture
def told():
    """Return the list of current problems, which is empty if the operator is healthy."""
    return []


@pytest.fixture
def ask(told):
    """Yield a function that returns the HTTP status and the text at a path."""
    metrics = Metrics()
    metrics.request("list", "pods", 200, 0.01)
    metrics.watch(
        depth=lambda: 3, leads=lambda: True, phases=lambda: PHASES, waits=list, outdated=lambda: False
    )
    trouble = lambda: told[0] if told else None  # noqa: E731 - both probes get the same response
    server = serving(Address("127.0.0.1", 0), healthy=trouble, ready=trouble, metrics=metrics.text)

    def get(path):
        try:
            with urllib.request.urlopen(f"http://{server.address}{path}", timeout=WAIT_S) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read().decode()

    yield get
    server.close()


@pytest.mark.parametrize("path", ["/healthz", "/readyz"])
def test_a_probe_fails_with_the_reason(path, ask, told):
    """`kubectl describe pod` shows the reason to an administrator."""
    assert ask(path) == (200, "ok\n")

    told.append("not read yet: pods")

    assert ask(path) == (503, "not read yet: pods\n")


def test_nothing_else_is_served(ask):
    """The port must not serve an index, a file or a profile."""
    assert ask("/../etc/passwd")[0] == 404


@pytest.mark.parametrize(
    "line",
    [
        'palaestra_operator_requests_total{code="200",resource="pods",verb="list"} 1.0',
        "palaestra_operator_queue_depth 3.0",
        "palaestra_operator_leader 1.0",
        'palaestra_jobs{job_namespace="robots",phase="Running"} 2.0',
        'palaestra_jobs{job_namespace="robots",phase="Succeeded"} 0.0',
        'palaestra_jobs{job_namespace="home",phase="Failed"} 1.0',
        'palaestra_operator_build_info{version="VERSION"} 1.0',
    ],
)
def test_what_the_operator_counts(line, ask):
    """Prometheus stores a series for each value of a label.

    So the labels have few values, and the name of a job is not a label.
    """
    line = line.replace("VERSION", version("palaestra"))

    assert line in ask("/metrics")[1].splitlines()


def test_the_error_for_a_taken_address_names_the_option():
    """A user may run two operators on one machine and must choose another port."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        where = Address(*taken.getsockname()[:2])

        with pytest.raises(PalaestraError, match=r"--metrics-address: .*: Address already in use; choose"):
            serving(where, healthy=str, ready=str, metrics=bytes)


@pytest.mark.parametrize("text", ["8080", ":8080", "localhost:", "localhost:http", "localhost:65536"])
def test_what_is_no_address_is_refused(text):
    """The user must see how an address is written, so the message has an example."""
    with pytest.raises(PalaestraError, match=r"write it as 0\.0\.0\.0:8080"):
        address(text)


def test_an_address_may_be_of_either_kind():
    """An address is of IPv4 or IPv6. In an IPv6 address, brackets separate its colons from the port."""
    assert address("[::1]:8080") == ("::1", 8080)
    assert address("0.0.0.0:0") == ("0.0.0.0", 0)
