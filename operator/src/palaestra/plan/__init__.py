"""Turn a TrainingJob into the objects that it needs.

The plan is pure: the same job and layout give the same objects. `plan` uses no clock, no network and no
random numbers. So tests/golden/ can store the plan of every example, for a cluster and for a laptop.

    plan(job, layout).objects
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from palaestra.api import TrainingJob
from palaestra.errors import PlanError
from palaestra.objects import Object
from palaestra.plan.claim import claim
from palaestra.plan.config_map import config_map
from palaestra.plan.job import job as replica_job
from palaestra.plan.layout import Allowed, ClusterLayout, ContainerPaths, Images, Layout, LocalLayout, Ports
from palaestra.plan.network_policy import network_policy
from palaestra.plan.pod import pod_template
from palaestra.plan.replica import Replica
from palaestra.plan.worlds import (
    ConfigMaps,
    Files,
    GivenWorld,
    Verdicts,
    WorldVerdict,
    given_worlds,
    source_files,
)

__all__ = [
    "Allowed",
    "ClusterLayout",
    "ConfigMaps",
    "ContainerPaths",
    "GivenWorld",
    "Images",
    "Layout",
    "LocalLayout",
    "Plan",
    "PlanError",
    "Ports",
    "ReplicaPlan",
    "Verdicts",
    "WorldVerdict",
    "given_worlds",
    "identified",
    "plan",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaPlan:
    """The objects of one replica."""

    config_map: Object
    claim: Object | None
    job: Object

    @property
    def objects(self) -> tuple[Object, ...]:
        """Return the objects in the order of their creation; the Job comes last: its pods need the others."""
        found = (self.config_map, self.claim, self.job)
        return tuple(part for part in found if part is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The objects of a TrainingJob: the network policy, and the objects of the planned replicas by index.

    `network_policy` is None in a layout whose pods do not have their own network.
    """

    network_policy: Object | None
    replicas: Mapping[int, ReplicaPlan]

    @property
    def objects(self) -> tuple[Object, ...]:
        """Return all objects in the order of their creation: the network policy is created before any pod."""
        policy = () if self.network_policy is None else (self.network_policy,)
        return (*policy, *(obj for replica in self.replicas.values() for obj in replica.objects))


def plan(
    job: TrainingJob,
    layout: Layout,
    config_maps: ConfigMaps | None = None,
    replicas: Collection[int] | None = None,
    verdicts: Verdicts | None = None,
) -> Plan:
    """Return the plan of a job that has a uid.

    `config_maps` contains the worlds of `configMap` sources, by name and key. `replicas` has the indices of
    the replicas to plan; by default, all replicas are planned. `verdicts` has the results of the checks of
    the job's worlds; without verdicts, this function checks the worlds.

    Raises:
        PlanError: the job cannot be planned in this layout, or its worlds are not checked yet.
        WorldError: a world of the job is invalid.
    """
    sources = source_files(job, config_maps or {}, verdicts)
    chosen = range(job.spec.replicas) if replicas is None else replicas
    planned = {
        index: _replica_plan(Replica(job=job, index=index, layout=layout), sources) for index in chosen
    }
    return Plan(network_policy=network_policy(job, layout), replicas=planned)


def identified(job: TrainingJob, uid: str) -> TrainingJob:
    """Return a copy of the job with a uid, for a job that was not created in a cluster."""
    metadata = job.metadata.model_copy(update={"uid": uid})
    return job.model_copy(update={"metadata": metadata})


def _replica_plan(replica: Replica, sources: Files) -> ReplicaPlan:
    configured = config_map(replica, sources)
    template = pod_template(replica, configured, sources)
    return ReplicaPlan(config_map=configured, claim=claim(replica), job=replica_job(replica, template))
