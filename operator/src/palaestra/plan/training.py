"""training.yaml: the job's settings for one replica, in the format that the trainer reads.

The trainer's `palaestra_trainer.job.configuration` declares all fields. On a laptop, the command line reads
only the addresses of a run from the file. `RunAddresses` is in this module, next to the code that writes
these addresses.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import yaml

from palaestra.api.simulators import Driver, Recycle, ResetMethod, SimulatorGroup
from palaestra.plan.claim import initial_path
from palaestra.plan.replica import PlannedSimulator, Replica
from palaestra.plan.resources import asks_for_gpu, in_bytes
from palaestra.plan.worlds import world_path
from palaestra.plan.yaml_text import as_yaml
from palaestra_protocol.fields import MOST_COUNT, MOST_NAME, Fields, ProtocolError

FILE = "training.yaml"
LOOPBACK = "127.0.0.1"
NEVER = Recycle(after_resets=0)
DO_NOT_AGE = (Driver.STUB, Driver.MUJOCO)
# In the experiments of the paper in CITATION.cff, Webots ended with a bus error after this number of resets.
AFTER_24_RESETS = Recycle(after_resets=24)
AFTER_EACH_RESET = Recycle(after_resets=1)


def training_yaml(replica: Replica, files: Mapping[str, bytes]) -> bytes:
    """Return the text of the replica's training.yaml; `files` has the worlds of the same ConfigMap."""
    return as_yaml([_training(replica, files)]).encode()


def status_address(replica: Replica) -> str:
    """Return the address at which the trainer serves /metrics, /status and /healthz."""
    return f"{replica.layout.health_host}:{replica.layout.ports.status}"


def _training(replica: Replica, files: Mapping[str, bytes]) -> dict[str, Any]:
    spec = replica.job.spec
    trainer = spec.trainer.model_dump(mode="json", by_alias=True, exclude_none=True)
    resume_from = spec.storage.resume_from
    another = replica.layout.another_run(resume_from, replica.index) if resume_from else None
    training = {
        "job": replica.job.metadata.name,
        "namespace": replica.job.metadata.namespace,
        "uid": replica.uid,
        "replica": replica.index,
        "seed": spec.seed + replica.index,
        "environment": trainer["environment"],
        "robot": spec.trainer.robot,
        "algorithm": trainer["algorithm"],
        "device": "cuda" if asks_for_gpu(spec.trainer.resources) else None,
        "steps": spec.trainer.steps,
        "collection": trainer.get("collection"),
        "evaluation": trainer["evaluation"],
        "checkpoint": trainer["checkpoint"],
        "resumeFrom": another,
        "initialPolicy": initial_path(replica),
        "stallDeadlineSeconds": spec.stall_deadline_seconds,
        "command": list(spec.trainer.command) or None,
        "statusAddress": status_address(replica),
        "simulators": [_simulator(replica, simulator, files) for simulator in replica.simulators],
    }
    return {field: value for field, value in training.items() if value is not None}


def _simulator(replica: Replica, simulator: PlannedSimulator, files: Mapping[str, bytes]) -> dict[str, Any]:
    group = simulator.group
    port = replica.layout.ports.control[simulator.place]
    described: dict[str, Any] = {
        "name": simulator.name,
        "group": group.name,
        "index": simulator.identity.index,
        "role": group.role.value,
        "minSimulators": group.min_simulators or group.count,
        "driver": group.driver.value,
        "options": list(group.options),
        "control": f"http://{LOOPBACK}:{port}",
        "world": world_path(replica, simulator, files),
    }
    if limits := _limits(recycling(group)):
        described["recycle"] = limits
    if group.reset is ResetMethod.RELOAD:
        described["reset"] = group.reset.value
    if group.standby:
        described["standby"] = True
    if group.batch is not None:
        described["batch"] = group.batch
    described["restart"] = {
        "limit": group.restart.limit,
        "withinSeconds": group.restart.within_seconds,
    }
    described["startDeadlineSeconds"] = group.start_deadline_seconds
    return described


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorAddress:
    """The address of one simulator's sidecar.

    Attributes:
        name: group and number of the simulator, such as `collect-0`.
        control: `host:port` of the sidecar.
        standby: whether the sidecar runs a second simulator as a standby.
    """

    name: str
    control: str
    standby: bool

    @classmethod
    def read(cls, content: object, path: str) -> Self:
        """Return the address in an entry of a training.yaml; `path` is the entry's path.

        Raises:
            ProtocolError: the entry has no address.
        """
        fields = Fields(content, path)
        return cls(
            name=fields.text("name", MOST_NAME),
            control=fields.text("control").removeprefix("http://"),
            standby=fields.has("standby") and fields.flag("standby"),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RunAddresses:
    """The addresses of a replica's programs on this machine.

    Attributes:
        status: `host:port` of the trainer's /status.
        simulators: the addresses of the simulators, in the order of the file.
    """

    status: str
    simulators: tuple[SimulatorAddress, ...]

    @classmethod
    def read(cls, text: bytes) -> Self:
        """Return the addresses in a training.yaml.

        Raises:
            ProtocolError: the text is not YAML, or has no addresses.
        """
        try:
            content = yaml.safe_load(text)
        except (ValueError, yaml.YAMLError) as error:
            raise ProtocolError(f"body: is not YAML ({type(error).__name__})") from error
        fields = Fields(content)
        return cls(
            status=fields.text("statusAddress"),
            simulators=fields.parts("simulators", SimulatorAddress.read, MOST_COUNT),
        )


def recycling(group: SimulatorGroup) -> Recycle:
    """Return the recycle limits of a group's simulators: the job's, or the default of the driver."""
    if group.reset is ResetMethod.RESTART:
        return (group.recycle or AFTER_EACH_RESET).model_copy(update={"after_resets": 1})
    if group.recycle is not None:
        return group.recycle
    return NEVER if group.driver in DO_NOT_AGE else AFTER_24_RESETS


def _limits(recycle: Recycle) -> dict[str, int]:
    """Return the limits above 0, with memory in bytes."""
    memory = recycle.above_memory
    limits = {
        "afterResets": recycle.after_resets,
        "afterMinutes": recycle.after_minutes,
        "aboveMemoryBytes": None if memory is None else in_bytes(memory),
    }
    return {name: limit for name, limit in limits.items() if limit}
