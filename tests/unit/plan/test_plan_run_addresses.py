"""The addresses of a local run, which the command line reads from the run's training.yaml."""

import pytest
import yaml

from palaestra.plan.training import RunAddresses
from palaestra_protocol.fields import ProtocolError
from palaestra_trainer.job.configuration import dump, parse


@pytest.fixture
def written(on_laptop, valid_job):
    """Return the training.yaml of a replica on a laptop, with a standby for the collecting simulator."""
    groups = valid_job().spec.model_dump(mode="json", by_alias=True, exclude_none=True)["simulators"]
    groups[0]["standby"] = True
    return on_laptop(simulators=groups).replicas[0].config_map["data"]["training.yaml"]


def test_the_addresses_are_those_that_the_plan_wrote(written):
    """A viewer or a progress line that requests another port would show another run, or fail."""
    content = yaml.safe_load(written)

    addresses = RunAddresses.read(written.encode())

    assert addresses.status == content["statusAddress"]
    assert [(one.name, f"http://{one.control}") for one in addresses.simulators] == [
        (simulator["name"], simulator["control"]) for simulator in content["simulators"]
    ]
    assert [one.standby for one in addresses.simulators] == [
        "standby" in simulator for simulator in content["simulators"]
    ]
    assert {one.standby for one in addresses.simulators} == {True, False}


def test_the_trainers_copy_has_the_same_addresses(written):
    """The trainer writes a copy of its configuration, with all defaults, into the run directory."""
    copy = dump(parse(yaml.safe_load(written)))

    assert RunAddresses.read(copy.encode()) == RunAddresses.read(written.encode())


@pytest.mark.parametrize(
    ("text", "mistake"),
    [
        (b"{", r"^body: is not YAML \(ParserError\)$"),
        (b"a: 2025-99-99", r"^body: is not YAML \(ValueError\)$"),
        (b"", r"^body: null is not an object$"),
        (b"simulators: []", r"^statusAddress: is missing$"),
        (b"statusAddress: a:1", r"^simulators: is missing$"),
        (b"{statusAddress: a:1, simulators: [{name: x}]}", r"^simulators\[0\]\.control: is missing$"),
    ],
)
def test_a_file_without_addresses_is_refused_with_the_missing_field(text, mistake):
    """A run that was killed while it started may leave a truncated file."""
    with pytest.raises(ProtocolError, match=mistake):
        RunAddresses.read(text)
