"""The containers of a replica's pod: the ROS master, a sidecar for each simulator, the trainer."""

import math
from collections.abc import Mapping
from typing import Any

from palaestra.api import Driver, SimulatorGroup
from palaestra.api.container import Resources, Variable
from palaestra.plan import resources as planned
from palaestra.plan.claim import INITIAL, initial_volume
from palaestra.plan.layout import ContainerPaths
from palaestra.plan.replica import INSTALL_SIDECAR, ROS_MASTER, TRAINER, PlannedSimulator, Replica
from palaestra.plan.training import FILE, LOOPBACK
from palaestra.plan.worlds import world_path
from palaestra.plan.yaml_text import literal

Container = dict[str, Any]

SIDECAR = "palaestra-sidecar"
PERIOD_S = 10  # seconds between two probes; one execution of the ROS master's probe has the same time limit
BUILT_IN = "palaestra-train"  # the trainer's program in a job without a custom command
SECURITY = {
    "allowPrivilegeEscalation": False,
    "capabilities": {"drop": ["ALL"]},
    "readOnlyRootFilesystem": True,
}
# The shortest period of a probe is a second, but the ROS master starts in a quarter of a second. So each
# execution of the probe's command polls the port until it is open. The port is on
# loopback, so a TCP probe of the kubelet cannot reach it.
MASTER_ANSWERS = "until (exec 3<>/dev/tcp/{host}/{port}) 2>/dev/null; do sleep 0.05; done"


def ros_master(replica: Replica) -> Container:
    """Return the ROS master, which is reachable on loopback only."""
    port = replica.layout.ports.ros_master
    probe = ["bash", "-c", MASTER_ANSWERS.format(host=LOOPBACK, port=port)]
    return {
        "name": ROS_MASTER,
        "image": _trainer_image(replica),
        "imagePullPolicy": replica.job.spec.trainer.image_pull_policy.value,
        "restartPolicy": "Always",
        "command": [word.format(port=port) for word in replica.layout.ros_master],
        "startupProbe": {
            "exec": {"command": probe},
            "periodSeconds": 1,
            "timeoutSeconds": PERIOD_S,
            "failureThreshold": _tries(replica),
        },
        **_common(replica, ROS_MASTER, _of_ros_master(replica), ()),
    }


def sidecar(replica: Replica, simulator: PlannedSimulator, worlds: Mapping[str, bytes]) -> Container:
    """Return the sidecar of one simulator; it starts the simulator when the trainer requests the start."""
    group, places = simulator.group, replica.places(simulator.container)
    ports = replica.layout.ports
    quantities = planned.resources(group.resources, _least(replica, group.driver))
    if group.standby:
        quantities = planned.for_two(quantities)
    common = _common(replica, simulator.container, quantities, group.env)
    program = SIDECAR
    if group.driver is Driver.COMMAND and places.sidecar is not None:
        program = f"{places.sidecar}/{SIDECAR}"
        common["volumeMounts"].append({"name": "sidecar", "mountPath": places.sidecar, "readOnly": True})
    return {
        "name": simulator.container,
        "image": _simulator_image(replica, simulator),
        "imagePullPolicy": replica.job.spec.trainer.image_pull_policy.value,
        "restartPolicy": "Always",
        "command": [program],
        "args": _arguments(replica, simulator, world_path(replica, simulator, worlds)),
        "ports": [_port(f"sim-{simulator.place}", ports.health[simulator.place])],
        # The sidecar has no startup probe. If the first start of a sidecar with a startup probe fails,
        # kubelets before 1.34.3 never start the trainer (Kubernetes issue 132826).
        "livenessProbe": {
            "initialDelaySeconds": min(group.start_deadline_seconds, _start_s(replica)),
            **_alive(ports.health[simulator.place]),
        },
        **common,
    }


def _arguments(replica: Replica, simulator: PlannedSimulator, world: str) -> list[str]:
    """Return the options of a sidecar, escaped so that a kubelet does not expand variables in them."""
    group, layout = simulator.group, replica.layout
    words = [
        f"--driver={group.driver.value}",
        f"--world={world}",
        *((f"--root={group.world.root}",) if group.world.root is not None else ()),
        f"--work={replica.places(simulator.container).scratch}/work",
        f"--control={LOOPBACK}:{layout.ports.control[simulator.place]}",
        f"--health={layout.health_host}:{layout.ports.health[simulator.place]}",
        *_identity(simulator),
        *(f"--option={option}" for option in options_of(group)),
        *(("--", *group.command) if group.command else ()),
    ]
    return [literal(word) for word in words]


def options_of(group: SimulatorGroup) -> tuple[str, ...]:
    """Return the options of a simulator: those of the job, and the number of copies."""
    return group.options if group.batch is None else (*group.options, f"--batch={group.batch}")


def trainer(replica: Replica) -> Container:
    """Return the trainer: the built-in loop, or the job's custom program."""
    spec, places = replica.job.spec.trainer, replica.places(TRAINER)
    port = replica.layout.ports.status
    least = planned.by_default(replica.layout.resources.trainer, planned.TRAINER)
    container = {
        "name": TRAINER,
        "image": _trainer_image(replica),
        "imagePullPolicy": spec.image_pull_policy.value,
        "command": [literal(word) for word in spec.command] or [BUILT_IN],
        "ports": [_port("metrics", port)],
        "terminationMessagePath": places.termination,
        "terminationMessagePolicy": "FallbackToLogsOnError",
        **_common(replica, TRAINER, planned.resources(spec.resources, least), spec.env),
    }
    if not spec.command:  # a custom program need not serve HTTP
        # On a busy node the import of PyTorch takes minutes, and the trainer responds only after the import.
        container["startupProbe"] = {**_healthz(port), "failureThreshold": _tries(replica)}
        container["livenessProbe"] = _alive(port)
    return container


def install_sidecar(replica: Replica) -> Container | None:
    """Return the init container that copies the sidecar for users' own images; None if no group needs it."""
    groups = replica.job.spec.simulators
    if replica.places(SIDECAR).sidecar is None or not any(group.driver is Driver.COMMAND for group in groups):
        return None
    target = replica.places(SIDECAR).sidecar
    return {
        "name": INSTALL_SIDECAR,
        "image": replica.layout.images.stub,
        "imagePullPolicy": replica.job.spec.trainer.image_pull_policy.value,
        # The command copies only the content of the folder, because cp has no permission to set the times of
        # the volume's root folder.
        "command": ["sh", "-c", f"cp -a /opt/palaestra/* {target}/"],
        "terminationMessagePolicy": "FallbackToLogsOnError",
        "securityContext": SECURITY,
        "resources": _of_ros_master(replica),
        "volumeMounts": [{"name": "sidecar", "mountPath": target}],
    }


def shared_memory(container: str) -> str:
    """Return the name of the shared-memory volume of a simulator's or the trainer's container."""
    return f"memory-{container}"


def _common(
    replica: Replica, container: str, quantities: planned.Planned, own: tuple[Variable, ...]
) -> Container:
    """Return the fields of every container: environment, resources, security context and mounts."""
    places = replica.places(container)
    env = {
        **_environment(replica, container, planned.threads(quantities)),
        **{variable.name: _variable(variable) for variable in own},
    }
    return {
        "env": [{"name": name, **value} for name, value in env.items()],
        "resources": quantities,
        "securityContext": SECURITY,
        "volumeMounts": _mounts(replica, container, places),
    }


def _environment(replica: Replica, container: str, threads: int) -> dict[str, dict[str, Any]]:
    places = replica.places(container)
    variables = {
        "ROS_MASTER_URI": f"http://{LOOPBACK}:{replica.layout.ports.ros_master}",
        "ROS_HOSTNAME": replica.layout.ros_hostname,
        "ROS_HOME": f"{places.scratch}/ros",
        # This folder must exist already: ROS would give a new folder to the volume's owner, root.
        "ROS_LOG_DIR": places.scratch,
        "PALAESTRA_CONFIG": f"{places.config}/{FILE}",
        "PALAESTRA_RUN": places.run,
        "OMP_NUM_THREADS": str(threads),
        "PYTHONUNBUFFERED": "1",  # the log must be readable while the program runs
        **({"HOME": places.home} if places.home is not None else {}),
        **({"PALAESTRA_TERMINATION_LOG": places.termination} if container == TRAINER else {}),
    }
    uid = {"valueFrom": {"fieldRef": {"fieldPath": "metadata.uid"}}}
    return {
        **{name: {"value": literal(value)} for name, value in variables.items()},
        "PALAESTRA_POD_UID": uid,
    }


def _mounts(replica: Replica, container: str, places: ContainerPaths) -> list[dict[str, Any]]:
    mounts: list[dict[str, Any]] = [
        {"name": "config", "mountPath": places.config, "readOnly": True},
        {"name": f"scratch-{container}", "mountPath": places.scratch},
    ]
    if container == TRAINER:
        mounts.append({"name": "run", "mountPath": places.volume})
        if initial_volume(replica) is not None:
            mounts.append({"name": INITIAL, "mountPath": places.initial, "readOnly": True})
    if container != ROS_MASTER and places.shared_memory is not None:
        mounts.append({"name": shared_memory(container), "mountPath": places.shared_memory})
    return mounts


def _variable(variable: Variable) -> dict[str, Any]:
    if variable.secret_key_ref is None:
        return {"value": literal(variable.value or "")}
    reference = variable.secret_key_ref
    return {"valueFrom": {"secretKeyRef": {"name": reference.name, "key": reference.key}}}


def _identity(simulator: PlannedSimulator) -> tuple[str, ...]:
    identity = simulator.identity
    return (
        f"--job={identity.job}",
        f"--namespace={identity.namespace}",
        f"--uid={identity.uid}",
        f"--replica={identity.replica}",
        f"--group={identity.group}",
        f"--index={identity.index}",
        *(("--clock",) if simulator.keeps_clock else ()),
        *(("--standby",) if simulator.group.standby else ()),
    )


def _simulator_image(replica: Replica, simulator: PlannedSimulator) -> str:
    images, driver = replica.layout.images, simulator.group.driver
    release = {Driver.MUJOCO: images.mujoco, Driver.WEBOTS: images.webots}.get(driver, images.stub)
    return simulator.group.image or release


def _least(replica: Replica, driver: Driver) -> Resources:
    """Return the default resources of a simulator."""
    release = planned.MUJOCO if driver is Driver.MUJOCO else planned.SIMULATOR
    return planned.by_default(replica.layout.resources.simulator, release)


def _of_ros_master(replica: Replica) -> planned.Planned:
    """Return the resources of the ROS master's container and of the container that copies the sidecar."""
    own = replica.job.spec.ros_master
    least = planned.by_default(replica.layout.resources.ros_master, planned.ROS_MASTER)
    return planned.resources(own.resources if own is not None else Resources(), least)


def _trainer_image(replica: Replica) -> str:
    return replica.job.spec.trainer.image or replica.layout.images.trainer


def _port(name: str, number: int) -> dict[str, Any]:
    return {"name": name, "containerPort": number, "protocol": "TCP"}


def _healthz(port: int) -> dict[str, Any]:
    """Return a probe that sends the request GET /healthz to the container."""
    return {
        "httpGet": {"path": "/healthz", "port": port},
        "periodSeconds": PERIOD_S,
        "timeoutSeconds": 5,
    }


def _alive(port: int) -> dict[str, Any]:
    """Return a liveness probe that fails only after a minute without a response, as on a busy node."""
    return {**_healthz(port), "failureThreshold": 6}


def _tries(replica: Replica) -> int:
    """Return the allowed failures of a startup probe; together they last as long as the start timeout."""
    return math.ceil(_start_s(replica) / PERIOD_S)


def _start_s(replica: Replica) -> int:
    allowed, bound = replica.job.spec.start_timeout_s, replica.layout.longest_start_s
    return allowed if bound is None else min(allowed, bound)
