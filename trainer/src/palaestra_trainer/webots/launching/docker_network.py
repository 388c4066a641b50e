"""Networks of a Docker Engine in which this machine and a container reach each other."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.addresses import is_loopback
from palaestra_trainer.webots.launching.master import ensure_master
from palaestra_trainer.webots.launching.sidecar_command import SIDECAR

HOST = "host"
_LOOPBACK = "127.0.0.1"
_CONTROL_PORT = 7100  # in a network of its own, a container can use any port
_OF_ROS = ("ROS_MASTER_URI", "ROS_HOSTNAME", "ROS_IP")
# Other nodes reach a container by its address, because they cannot resolve the name of a container.
_WITH_ADDRESS = f'ROS_IP=$(hostname -i) && export ROS_IP && exec {SIDECAR} "$@"'


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerNetwork:
    """The settings with which a sidecar in a container listens, and with which this machine reaches it.

    Attributes:
        listeners: the sidecar's options for its listeners.
        entrypoint: the words before the sidecar's options.
        environment: the environment variables of the container.
        address: returns the address of a running container.
    """

    listeners: Sequence[str]
    entrypoint: Sequence[str]
    environment: Mapping[str, str]
    address: Callable[[Any], str]


def network_of(engine: Any, name: str) -> ContainerNetwork:
    """Return the settings of a container in the network with this name. If no ROS master runs, start one.

    Raises:
        ConfigurationError: this machine and a container cannot reach each other in this network.
        docker.errors.NotFound: the engine has no such network.
    """
    return _host(engine) if name == HOST else _bridge(engine.networks.get(name).attrs)


def _host(engine: Any) -> ContainerNetwork:
    if "name=rootless" in engine.info().get("SecurityOptions", ()):
        raise ConfigurationError(
            'launcher docker: network "host" of a rootless engine is not the network of this machine; use an '
            'engine of root, or launcher="process"'
        )
    ensure_master()
    return ContainerNetwork(
        listeners=(f"--control={_LOOPBACK}:0", f"--health={_LOOPBACK}:0", "--until-stdin-closes"),
        entrypoint=(SIDECAR,),
        environment={name: os.environ[name] for name in _OF_ROS if name in os.environ},
        address=lambda _: _LOOPBACK,
    )


def _bridge(network: Mapping[str, Any]) -> ContainerNetwork:
    name = network["Name"]
    gateways = [each["Gateway"] for each in network["IPAM"]["Config"] or () if "Gateway" in each]
    if network["Driver"] != "bridge" or not gateways:
        raise ConfigurationError(
            f"launcher docker: network {name} has driver {network['Driver']} and {len(gateways)} gateways; "
            'use a network with driver bridge, or "host"'
        )
    ensure_master(gateways[0])
    uri = os.environ["ROS_MASTER_URI"]
    if is_loopback(str(urlsplit(uri).hostname)):
        raise ConfigurationError(
            f"launcher docker: a container in network {name} cannot reach the ROS master at {uri}; set "
            f"ROS_MASTER_URI to a master that listens on {gateways[0]}, start this program without "
            'ROS_MASTER_URI, or use network="host"'
        )
    return ContainerNetwork(
        listeners=(
            f"--control=0.0.0.0:{_CONTROL_PORT}",
            f"--health={_LOOPBACK}:0",
            "--allow-remote-control",
            "--until-stdin-closes",
        ),
        entrypoint=("sh", "-c", _WITH_ADDRESS, SIDECAR),
        environment={"ROS_MASTER_URI": uri},
        address=lambda container: _address_in(container, name),
    )


def _address_in(container: Any, network: str) -> str:
    """Return the address of a running container in a network.

    Raises:
        ConfigurationError: the container has no address there, since it has ended.
    """
    container.reload()
    address: str = container.attrs["NetworkSettings"]["Networks"].get(network, {}).get("IPAddress", "")
    if not address:
        raise ConfigurationError(f"launcher docker: the container has no address in network {network}")
    return address
