"""Scrape targets with the labels that the chart's PodMonitor and ServiceMonitor set in a cluster."""

import re
from collections.abc import Iterator

from tests.local_run import LocalRun
from tests.monitoring.prometheus import Target

ADDRESSES = re.compile(r"--control=(\S+) --health=(\S+)")


def of_run(run: LocalRun, namespace: str) -> list[Target]:
    """Wait for the trainer and the sidecars of a local run, and return them as scrape targets."""
    simulators = run.until(lambda: list(_sidecars(run)) if run.status() else None)
    pod = {"namespace": namespace, "pod": f"{run.name}-0", "training_job": run.name, "replica": "0"}
    trainer = Target(run.training()["statusAddress"], pod | {"container": "trainer"})
    sidecars = (
        Target(address, pod | {"container": f"sim-{name}", "simulator": name}) for name, address in simulators
    )
    return [trainer, *sidecars]


def of_operator(address: str, pod: str = "palaestra-operator-0") -> Target:
    """Return the target of an operator that serves at `address`."""
    return Target(address, {"namespace": "palaestra-system", "pod": pod, "container": "operator"})


def _sidecars(run: LocalRun) -> Iterator[tuple[str, str]]:
    """Yield the name of each simulator, and the address of its sidecar for health and metrics."""
    names = {simulator["control"]: simulator["name"] for simulator in run.training()["simulators"]}
    for _, words in run.processes():
        command = " ".join(words)
        if "palaestra-sidecar" in command and (found := ADDRESSES.search(command)):
            control, health = found.groups()
            yield names[f"http://{control}"], health
