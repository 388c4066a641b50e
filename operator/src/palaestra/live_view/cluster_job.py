"""The simulators of a job in a cluster, read from their sidecars through the API server.

The view opens no additional port of a pod. The user needs the permission `get` on pods/proxy, and the API
server must be able to reach the health ports of the pods.
"""

from __future__ import annotations

import json
from functools import partial
from http import HTTPStatus
from importlib.metadata import version
from typing import Final

from palaestra.client import Client
from palaestra.client.client import newest_pod
from palaestra.cluster import ApiError, Forbidden
from palaestra.live_view.source import (
    EpisodeReader,
    Fetch,
    NotShown,
    SidecarSource,
    StatusReader,
    of_either,
)
from palaestra.plan import ClusterLayout, Images
from palaestra.plan.replica import PlannedSimulator, Replica

# Reasons of errors from a sidecar; errors of the API server have a Kubernetes reason.
_OF_THE_SIDECAR: Final = ("HTTP404", "HTTP503")


class ClusterJob:
    """One replica of a job in a cluster.

    Args:
        client: the client for the cluster.
        name: the name of the job.
        replica: the number of the replica.
    """

    def __init__(self, client: Client, name: str, replica: int) -> None:
        self._client = client
        self._name = name
        self._replica = replica

    def sources(self) -> tuple[SidecarSource, ...]:
        """Return the simulators of the replica's newest pod.

        Raises:
            NoSuchJob: no job has this name.
            NoPod: the replica has no pod.
        """
        job = self._client.get(self._name)
        pod = newest_pod(job, self._replica)
        layout = ClusterLayout(images=Images.of_release(version("palaestra")))
        simulators = Replica(job=job, index=self._replica, layout=layout).simulators
        trainer = partial(self._fetch, pod.name, layout.ports.status)
        episodes, run = EpisodeReader(trainer), StatusReader(trainer)
        return tuple(
            SidecarSource(
                name=simulator.name,
                fetch=self._reader(pod.name, layout.ports.health[simulator.place], simulator),
                episodes=episodes,
                run=run,
            )
            for simulator in simulators
        )

    def _reader(self, pod: str, port: int, simulator: PlannedSimulator) -> Fetch:
        fetch = partial(self._fetch, pod, port)
        return of_either(fetch) if simulator.group.standby else fetch

    def _fetch(self, pod: str, port: int, path: str, most_bytes: int) -> tuple[int, bytes]:
        try:
            text = self._client.api.proxied(self._client.namespace, pod, port, path)
        except Forbidden as error:
            raise NotShown(f"{error}; ask for the right `get` on pods/proxy") from error
        except ApiError as error:
            if error.reason in _OF_THE_SIDECAR:
                return error.code, json.dumps({"error": error.message}).encode()
            raise ConnectionError(str(error)) from error
        return HTTPStatus.OK, text.encode()[: most_bytes + 1]
